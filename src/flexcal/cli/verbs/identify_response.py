"""`flexcal identify response`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, cast

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Between,
    Json,
    MaybeNumber,
    MaybeText,
    Numbers,
    Paths,
    Texts,
    file_argument,
    require_robot,
)
from flexcal.cli.terminal.console import Console
from flexcal.errors import InputError
from flexcal.printable import quoted

_ROBOT = (".yaml", ".yml")
_RECOGNISED = "(default: recognised by names and units)"


@dataclass(frozen=True)
class IdentifyResponse:
    """Estimate frequency responses with their covariance.

    With robot.yaml and the folder of a planned frequency experiment: one response matrix per pose, for 'identify stiffness'.

    With files of any other experiment (CSV, text, Excel, MAT, Parquet, …; several are repetitions): sweeps, noise, multisines, steps or
    blows, one sign, without a plan. Input and output columns are recognised, else named. The period is detected. The response has a
    coherence and intervals; resonances and antiresonances are fitted by maximum likelihood, and an axis of one to three masses.
    """

    source: Annotated[
        Positional[Paths],
        file_argument(
            "ROBOT DIR | FILE...",
            "robot.yaml and the folder with plan.yaml and one joint log per recording; or records of any excitation",
        ),
    ]
    out: Annotated[Path, arg(metavar="DIR")] = Path("responses")
    """Folder for the responses, report.html and results.json."""
    method: Annotated[
        Literal[
            "arithmetic",
            "logarithmic",
            "harmonic",
            "h1",
            "joint-input-output",
            "errors-in-variables",
            "local-polynomial",
        ],
        arg(help_behavior_hint="(default: arithmetic; without a plan always local-polynomial)"),
    ] = "arithmetic"
    """How the realisations of a plan are averaged; or the local polynomial method, for one realisation or without a steady state."""
    input: Annotated[Texts, arg(metavar="COLUMN...", help_behavior_hint=_RECOGNISED)] = ()
    """Without a plan: torque, force, current or command that drives the axis, as COLUMN or COLUMN[unit]; several for several axes."""
    output: Annotated[Texts, arg(metavar="COLUMN...", help_behavior_hint=_RECOGNISED)] = ()
    """What moves, as COLUMN, COLUMN[unit] or COLUMN=position, =velocity or =acceleration; the motor's own first."""
    reference: Annotated[
        Texts, arg(metavar="COLUMN...", help_behavior_hint="(default: recognised where a controller acts)")
    ] = ()
    """What the controller was asked for, where one acts on the output: noise in its feedback then does not bias the response."""
    rate: Annotated[
        MaybeNumber,
        arg(metavar="HZ", help_behavior_hint="(default: from the column of time)"),
        Between(1e-3, 1e9),
    ] = None
    """Sampling rate of files without usable time stamps."""
    band: Annotated[
        Numbers, arg(metavar="LOW HIGH", help_behavior_hint="(default: where the input determines it)")
    ] = ()
    """Frequencies to use, Hz."""
    torque: Annotated[
        Literal["held", "instantaneous", "mean"],
        arg(help_behavior_hint="(default: held)"),
    ] = "held"
    """What a sample of the input is: held until the next one (a command), the value at the instant (a sensor), or a mean over the step."""
    modes: Annotated[MaybeText, arg(metavar="N", help_behavior_hint="(default: by evidence)")] = None
    """Number of resonances to fit."""
    masses: Annotated[MaybeText, arg(metavar="N", help_behavior_hint="(default: by evidence)")] = None
    """Number of masses of the axis, 1 to 3."""
    json: Json = False

    def run(self) -> None:
        """Estimate, and print the uncertainty of the responses."""
        if not self.source:
            raise InputError(
                "E-CLI-028",
                "no records given; name robot.yaml and the folder of an experiment, or files of records.",
            )
        if any(path.suffix in _ROBOT or (path / "plan.yaml").is_file() for path in self.source):
            self._planned()
        else:
            self._unplanned()

    def _planned(self) -> None:
        from flexcal.cli.tables.results import response_table
        from flexcal.jobs.response import identify_response

        if len(self.source) != 2 or not self.source[1].is_dir():
            if any(path.suffix in _ROBOT for path in self.source[1:]):
                require_robot(*self.source)
            if self.source[0].suffix in _ROBOT and len(self.source) > 1:
                require_robot(self.source[0], *self.source[1:])
                files = " ".join(map(quoted, self.source[1:]))
                raise InputError(
                    "E-CLI-029",
                    f"{self.source[1]} is no folder with a plan; records without one need no robot: "
                    f"'flexcal identify response {files}'.",
                )
            raise InputError(
                "E-CLI-030",
                "a planned experiment needs robot.yaml, then the folder with plan.yaml and the joint logs.",
            )
        robot, folder = self.source
        require_robot(robot, folder)
        console = Console(self.json)
        with console.progress() as progress:
            method = cast(Any, self.method.replace("-", "_"))
            responses = identify_response(
                robot, folder, self.out, method=method, command=command_line(), progress=progress
            )
        document = responses.document()
        console.show(response_table(document["responses"]))
        for remark in responses.sensor_remarks:
            console.say(remark)
        console.say(responses.trust.sentence)
        console.say(f"wrote {self.out / 'report.html'}")
        console.finish(document, f"flexcal identify stiffness {quoted(robot)} {quoted(self.out)}")

    def _unplanned(self) -> None:
        from flexcal.cli.tables.excitation import element_table, masses_table, resonance_table
        from flexcal.jobs.response import ExcitationOptions, identify_excitation

        options = ExcitationOptions(
            inputs=self.input,
            outputs=self.output,
            references=self.reference,
            rate_hz=self.rate,
            band=self.band,
            hold=self.torque,
            modes=_count("modes", self.modes, 0, 12),
            masses=_count("masses", self.masses, 1, 3),
        )
        if self.method not in ("arithmetic", "local-polynomial"):
            raise InputError(
                "E-CLI-031",
                f"--method {self.method} is for planned experiments; without a plan it is the local polynomial method, which is H1 without "
                "leakage; leave --method out.",
            )
        console = Console(self.json)
        with console.progress() as progress:
            identified = identify_excitation(
                _files(self.source), self.out, options, command=command_line(), progress=progress
            )
        document = identified.document()
        for remark in document["remarks"]:
            console.say(remark)
        console.show(element_table(document))
        if document["resonances"]:
            console.show(resonance_table(document))
        if document["masses"]["count"]:
            console.show(masses_table(document["masses"]))
        else:
            console.say(f"no masses were fitted: {document['masses']['reason']}")
        console.say(identified.trust.sentence)
        console.say(f"wrote {self.out / 'response.csv'}")
        console.say(f"wrote {self.out / 'report.html'}")
        console.finish(document, _next(document, self.out))


def _next(document: dict[str, Any], out: Path) -> str:
    masses = document["masses"]
    if masses["reason"].startswith("no antiresonance") or document["halves"] is None:
        return f"record the experiment again and give both files, to see whether the response repeats; or read {out / 'report.html'}"
    return f"read {out / 'report.html'}; for the springs of a whole robot, flexcal design frequency robot.yaml --out frequency.yaml"


def _count(name: str, text: str | None, least: int, most: int) -> int | None:
    if text is None:
        return None
    if not text.isdigit() or not least <= int(text) <= most:
        raise InputError(
            "E-CLI-033", f"--{name} is {text}; it must be a whole number from {least} to {most}."
        )
    return int(text)


def _files(source: tuple[Path, ...]) -> list[Path]:
    """The files, and those in folders that are named."""
    files: list[Path] = []
    for path in source:
        if not path.is_dir() or (path / "metadata.yaml").is_file():
            files.append(path)
            continue
        inside = sorted(
            one
            for one in path.iterdir()
            if one.is_file() and one.suffix.lower() in (".csv", ".txt", ".tsv", ".dat", ".parquet", ".mat")
        )
        if not inside:
            raise InputError("E-CLI-034", f"{path}: the folder holds neither plan.yaml nor files of records.")
        files += inside
    return files
