"""`flexcal study`."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import PROCESS_COUNT, Json, MaybeCount, MaybeText
from flexcal.cli.arguments.verb_table import VERBS
from flexcal.cli.folders.overwrite_protection import outputs
from flexcal.cli.terminal.console import Console
from flexcal.errors import FlexcalError


@dataclass(frozen=True)
class Study:
    """Run many tasks: calibrations of virtual robots over seeds and options, or of resampled measurements; each a row of a table.

    Rows are stored as tasks end. An interrupted study goes on with --resume. A failed task is a row with its error. Tasks run in processes
    of this machine or, with --on, on a Dask cluster, with the same results.
    """

    study: Annotated[Positional[Path], arg(metavar="STUDY", help="STUDY.yaml: robot, kind of task, options")]
    out: Annotated[Path, arg(metavar="DIR")] = Path("study")
    """Folder for tasks.parquet, results.json and report.html, and, while the study runs, tasks.jsonl."""
    on: Annotated[MaybeText, arg(metavar="ADDRESS", help_behavior_hint="(default: this machine)")] = None
    """Dask scheduler, dask://host:port or tls://host:port. Its workers need the same flexcal, and run whatever they are sent: use only a
    cluster of your own."""
    jobs: Annotated[
        MaybeCount, arg(metavar="N", help_behavior_hint="(default: one a core)"), PROCESS_COUNT
    ] = None
    """Number of processes on this machine."""
    resume: bool = False
    """Go on with the study in DIR: only tasks that are not stored yet run."""
    json: Json = False

    def run(self) -> None:
        """Run the tasks, and print what they say together."""
        from flexcal.jobs.study import read_study, run_study
        from flexcal.parallel import open_workers

        leaves = next(verb.leaves for verb in VERBS if verb.name == "study")
        console = Console(self.json)
        plan = read_study(self.study)
        jobs = min(self.jobs or os.cpu_count() or 1, len(plan.rows))
        with open_workers(self.on, jobs) as workers, console.progress() as progress:
            try:
                document = run_study(
                    plan,
                    self.out,
                    workers,
                    resume=self.resume,
                    command=command_line(),
                    progress=progress,
                    publishing=lambda: outputs("study", self.out, leaves),
                )
            except KeyboardInterrupt:
                console.say(f"tasks that have ended are stored in {self.out}; go on with --resume")
                raise
        for line in _lines(document):
            console.say(line)
        console.finish(document, f"open {self.out / 'report.html'}")
        if document["tasks"]["failed"] == document["tasks"]["total"]:
            raise FlexcalError(
                "E-STUDY-024",
                f"all {document['tasks']['total']} tasks failed; correct what their errors name, and run the study with another --out.",
            )


def _lines(document: dict[str, Any]) -> list[str]:
    from flexcal.report.layout import counted, listed
    from flexcal.report.results import FEWEST_RESAMPLES, effect_sentence, share_between

    count = document["tasks"]
    lines = [
        *document["remarks"],
        f"{count['done']} of {count['total']} tasks have ended, {count['failed']} with an error",
    ]
    error = document["errors"].get(document["error"], {}).get("p90_mm")
    if error and error["tasks"]:
        middle = f"90th percentile of the errors ({document['error']}): median {error['median']:.4f} mm over the tasks"
        span = (
            f", {error['low']:.4f} to {error['high']:.4f} mm in {share_between(error)} of them"
            if error["tasks"] > 1
            else ""
        )
        lines.append(middle + span)
    covered = document["coverage"]
    if covered and covered["low"] is not None:
        lines.append(
            f"95 % intervals that hold the true value: {100 * covered['share']:.1f} % "
            f"({100 * covered['low']:.1f} to {100 * covered['high']:.1f} %)"
        )
    block = document["resampling"]
    if block and block["ratio"]:
        few = (
            ""
            if block["resamples"] >= FEWEST_RESAMPLES
            else f"; {block['resamples']} data sets are too few to judge by"
        )
        expected = "" if block["expected"] < 1.05 else f"; of sound data {block['expected']:.2g} times"
        lines.append(
            f"the estimates spread over the resampled data {block['ratio']:.2g} times as much as the fit states (median over the "
            f"parameters{expected}{few})"
        )
        larger = block["surely_larger"]
        if larger:
            lines.append(
                f"{listed(larger, 3)}: more spread than the fit states, by more than chance explains"
            )
    lines += [effect_sentence(item) for item in document["effects"]]
    for item in document["failures"][:3]:
        lines.append(f"failed, {counted(item['tasks'], 'task')}: {item['error']}")
    return lines
