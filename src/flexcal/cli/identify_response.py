"""`flexcal identify response`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, cast

from tyro.conf import Positional, arg

from flexcal.cli.command_line import command_line
from flexcal.cli.console import Console
from flexcal.cli.options import Json, Robot, require_robot


@dataclass(frozen=True)
class IdentifyResponse:
    """Estimate one frequency response matrix per pose from the recordings of a frequency experiment, with its covariance."""

    robot: Robot
    folder: Annotated[
        Positional[Path], arg(metavar="DIR", help="folder with plan.yaml and one joint log per recording")
    ]
    out: Annotated[Path, arg(metavar="DIR")] = Path("responses")
    """Folder for the responses, report.html and results.json."""
    method: Literal[
        "arithmetic",
        "logarithmic",
        "harmonic",
        "h1",
        "joint-input-output",
        "errors-in-variables",
        "local-polynomial",
    ] = "arithmetic"
    """How the realisations are averaged; or the local polynomial method, for one realisation or records without a steady state."""
    json: Json = False

    def run(self) -> None:
        """Estimate, and print the uncertainty of the responses."""
        from flexcal.cli.tables import response_table
        from flexcal.workflow.identify_response import identify_response

        require_robot(self.robot, self.folder)
        console = Console(self.json)
        with console.progress() as progress:
            method = cast(Any, self.method.replace("-", "_"))
            found = identify_response(
                self.robot, self.folder, self.out, method=method, command=command_line(), progress=progress
            )
        document = found.document()
        console.show(response_table(document["responses"]))
        for remark in found.sensor_remarks:
            console.say(remark)
        console.say(found.trust.sentence)
        console.say(f"wrote {self.out / 'report.html'}")
        console.finish(document, f"flexcal identify stiffness {self.robot} {self.out}")
