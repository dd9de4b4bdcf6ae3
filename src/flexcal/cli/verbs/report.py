"""`flexcal report`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from flexcal.cli.arguments.particulars import ParticularsOptions
from flexcal.cli.arguments.shared_options import Json, MaybePath
from flexcal.cli.folders.changed_files import stored_files
from flexcal.cli.terminal.console import Console
from flexcal.errors import InputError


@dataclass(frozen=True)
class Report(ParticularsOptions):
    """Write report.html of a folder that demo, an identify verb, calibrate or verify wrote with --out, from the stored numbers.

    The page is identical to the one that the verb wrote. With --customer, DIR/customer.html is written instead, two sheets of A4:
    particulars of the measurement, errors before and after, and their uncertainty. Particulars that are not given stay lines to fill in by
    hand.
    """

    folder: Annotated[Positional[Path], arg(metavar="DIR", help="folder with results.json")]
    compare: Annotated[MaybePath, arg(metavar="OTHER", help_behavior_hint="(default: none)")] = None
    """Another folder of calibrate, verify or demo; DIR/comparison.html then compares accuracy and parameters of the two."""
    robot: MaybePath = None
    """With --compare: the robot.yaml of both calibrations, from which it is told whether the robot changed; by default one in or above
    the folders."""
    customer: bool = False
    """Write the two sheets for a customer, from a folder of calibrate or verify."""
    json: Json = False

    @property
    def out(self) -> Path:
        """The file that is written; raises `InputError` where DIR is a file."""
        if self.folder.is_file():
            raise InputError(
                "E-CLI-037", f"{self.folder} is no folder; give the folder that holds results.json."
            )
        if self.customer:
            return self.folder / "customer.html"
        return self.folder / ("report.html" if self.compare is None else "comparison.html")

    def run(self) -> None:
        """Write the report, and say where it is."""
        from flexcal.report.results import NOT_GIVEN

        console = Console(self.json)
        if self.customer and self.compare is not None:
            raise InputError("E-CLI-038", "--customer and --compare exclude each other; give one of them.")
        if not self.customer and self.particulars != NOT_GIVEN:
            raise InputError(
                "E-CLI-039", "particulars of the measurement are for the customer's sheets; add --customer."
            )
        if self.customer:
            self._for_customer(console)
            return
        if self.compare is not None:
            self._compare(console, self.compare)
            return
        from flexcal.jobs.pages import report_folder

        with stored_files(self.folder):
            written = report_folder(self.folder)
        console.say(f"wrote {written}, from the numbers stored beside it")
        console.finish({"report": written}, f"open {written}")

    def _for_customer(self, console: Console) -> None:
        from flexcal.jobs.pages import customer_report

        with stored_files(self.folder):
            written = customer_report(self.folder, self.particulars)
        console.say(f"wrote {written}: two sheets of A4")
        console.finish({"report": written}, f"open {written}, and print it or save it as PDF")

    def _compare(self, console: Console, other: Path) -> None:
        from flexcal.jobs.pages import compare_folders

        with stored_files(self.folder, other):
            document = compare_folders(self.folder, other, self.robot)
        if document["geometry"] is not None:
            _say_change(console, document["geometry"])
        elif document["geometry_not_compared"]:
            console.say(document["geometry_not_compared"])
        first, second = document["runs"]
        difference = document["difference_mm"]
        real = "significant" if difference["significant"] else "not significant"
        console.say(
            f"mean error of {second} minus that of {first}: {difference['mean']:+.3f} mm, 95 % interval {difference['low']:+.3f} to "
            f"{difference['high']:+.3f} mm: {real}"
        )
        for block, changes in document["parameters"].items():
            if block == "calibration" and document["geometry"] is not None:
                continue  # the robots were compared, whatever the fits dropped
            console.say(
                f"{block}: {len(changes['changed'])} of {changes['compared']} parameters changed by more than their joint uncertainty"
            )
        if document["parameters"] and document["shared"]:
            console.say(
                f"the runs share {', '.join(document['shared'])}: their parameters are not independent"
            )
        console.say(f"wrote {self.out}")
        console.finish({"report": self.out} | document, f"open {self.out}")


def _say_change(console: Console, change: dict[str, Any]) -> None:
    """Verdict on the robot, and how far its tool moved."""
    moved = change["displacement_mm"]
    place = ", ".join(f"{value:.2f}" for value in moved["worst_at_m"])
    console.say(f"the robot: {change['verdict']}")
    console.say(
        f"the tool moved by {moved['p90_mm']:.3f} mm (P90) within the joint ranges of both, at most {moved['max_mm']:.3f} mm at "
        f"[{place}] m, where {moved['std']:.3f} mm are uncertain (1σ), after the base was registered"
    )
