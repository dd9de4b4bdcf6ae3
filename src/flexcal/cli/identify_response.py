"""`flexcal identify response`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from flexcal.cli.console import Console
from flexcal.cli.options import Json, Robot


@dataclass(frozen=True)
class IdentifyResponse:
    """Reduce the recordings of a frequency experiment to one frequency response matrix a pose, with noise and distortion."""

    robot: Robot
    folder: Annotated[
        Positional[Path], arg(metavar="DIR", help="folder with plan.yaml and one joint log per recording")
    ]
    out: Annotated[Path, arg(metavar="DIR")] = Path("responses")
    """Folder for the responses."""
    average: Literal["arithmetic", "logarithmic", "harmonic", "h1", "joint_input_output"] = "arithmetic"
    """How the realisations are averaged."""
    json: Json = False

    def run(self) -> None:
        """Reduce, and print how certain the responses are."""
        from flexcal.cli.tables import response_table
        from flexcal.workflow.identify_response import identify_response

        console = Console(self.json)
        with console.progress() as progress:
            found = identify_response(
                self.robot, self.folder, self.out, average=self.average, progress=progress
            )
        document = found.document()
        console.show(response_table(document["responses"]))
        console.finish(document, f"flexcal identify stiffness {self.robot} {self.out}")
