"""`flexcal report`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flexcal.cli.console import Console
from flexcal.cli.options import Json
from flexcal.errors import InputError


@dataclass(frozen=True)
class Report:
    """Write report.html of a folder that demo, identify dynamics or stiffness, calibrate or verify left with --out, from stored numbers.

    Figures that need the fit itself are not in it; the verb that made the folder writes them all.
    """

    folder: Annotated[Positional[Path], arg(metavar="DIR", help="folder with results.json")]
    json: Json = False

    @property
    def out(self) -> Path:
        """The file that is written; raises `InputError` where DIR is a file."""
        if self.folder.is_file():
            raise InputError(f"{self.folder} is no folder; give the folder that holds results.json.")
        return self.folder / "report.html"

    def run(self) -> None:
        """Write the report, and say where it is."""
        from flexcal.workflow.report_folder import report_folder

        console = Console(self.json)
        written = report_folder(self.folder)
        console.say(f"wrote {written}, from the numbers stored beside it")
        console.finish({"report": written}, f"open {written}")
