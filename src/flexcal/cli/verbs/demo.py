"""`flexcal demo`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Json,
    MaybePath,
    Seed,
)
from flexcal.cli.terminal.console import Console


@dataclass(frozen=True)
class Demo:
    """Run the whole two-stage calibration on a virtual robot with hidden true parameters, and compare with these at the end."""

    seed: Seed = 1
    """Seed of the true parameters and all noise."""
    plan: Literal["default", "paper", "designed", "quick"] = "default"
    """default: six poses with a payload; paper: three poses without, which determine less; designed: poses and amplitudes optimised for
    this robot; quick: the same in half the time, and 25 calibration poses."""
    cell: Literal["virtual", "hard"] = "virtual"
    """virtual: a robot of the identified model with random parameters; hard: an independently implemented robot with an elastic wrist, gear
    errors, other friction, drift and a tracker with wrongly stated noise, which the identified model lacks."""
    truth: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="(default: drawn from the seed)")] = (
        None
    )
    """File of true parameters, in the form of estimates.yaml."""
    out: Annotated[Path, arg(metavar="DIR")] = Path("demo")
    """Folder for all results, with report.html and results.json."""
    json: Json = False
    robot: Annotated[
        MaybePath, arg(metavar="ROBOT", help_behavior_hint="(default: the TX90L of flexcal's examples)")
    ] = None
    """Another robot.yaml, with cell.yaml and frequency_poses.csv beside it."""

    def run(self) -> None:
        """Run everything, and print the numbers."""
        from flexcal.cli.tables.results import comparison_table, error_table, gain_table
        from flexcal.jobs.inputs import example_robot
        from flexcal.jobs.result_files import read_results
        from flexcal.jobs.two_stage import run_two_stage

        console = Console(self.json)
        robot = example_robot("tx90l") if self.robot is None else self.robot
        with console.progress() as progress:
            demo = run_two_stage(
                robot,
                self.out,
                seed=self.seed,
                plan=self.plan,
                cell=self.cell,
                truth=self.truth,
                command=command_line(),
                progress=progress,
            )
        document = read_results(self.out)
        for kind in ("stiffness", "damping"):
            console.show(comparison_table(kind, document["stage1"][kind]))
        seen = document["identifiability"]
        console.say(f"{seen['rank']} of {seen['parameters']} geometric parameters are identifiable")
        rows = {"calibration poses": document["calibration"]}
        rows |= {
            label: document["verification"][key]
            for key, label in _VERIFICATION.items()
            if document["verification"].get(key)
        }
        console.show(error_table("distance between prediction and point", rows))
        if document["cad_alone"] is not None:
            console.show(gain_table(document))
        console.say(demo.trust.sentence)
        console.say(f"took {document['seconds']['total']:.0f} s; all results are in {self.out}")
        console.finish(document, f"open {self.out / 'report.html'}")


_VERIFICATION = {
    "nominal": "fresh poses, before (best-fit registered)",
    "own": "fresh poses, before (the robot's own)",
    "measured": "fresh poses, as the tracker reads them",
    "elastic": "  against the noise-free truth",
    "elastic_unambiguous": "  of these, flank certain",
    "rigid": "  calibrated as rigid",
    "floor": "  with every parameter known",
}
