"""`flexcal repeatability`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Estimates,
    Json,
    MaybePath,
    PoseFiles,
    Robot,
    require_robot_and_files,
)
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted


@dataclass(frozen=True)
class Repeatability:
    """Determine pose accuracy and repeatability (ISO 9283: AP, RP, vAP, dAP, dRP) from repeated visits to the same poses.

    Rows with the same joint positions are visits to one pose, whatever their numbers; other rows are left out. RP needs no
    calibration. Where the visits have times (t) and a pose has 20 or more, the drift of both is given too (dAP, dRP).
    """

    robot: Robot
    poses: PoseFiles
    estimates: Estimates = None
    out: Annotated[MaybePath, arg(metavar="DIR", help_behavior_hint="(default: none)")] = None
    """Folder for report.html and results.json; without it there is no report."""
    json: Json = False

    def run(self) -> None:
        """Evaluate the visits, and print AP and RP."""
        from flexcal.cli.tables.results import repeatability_table
        from flexcal.jobs.accuracy import robot_repeatability

        require_robot_and_files(self.robot, self.poses, "POSES")
        console = Console(self.json)
        with console.progress() as progress:
            document = robot_repeatability(
                self.robot,
                self.poses,
                estimates=self.estimates,
                out=self.out,
                command=command_line(),
                progress=progress,
            ).document()
        console.show(repeatability_table(document))
        noise = document["instrument_rp_mm"]
        if noise is not None:
            console.say(f"the instrument's noise alone corresponds to an RP of {noise:.3f} mm")
        if (drift := document["drift"]) is not None:
            moved = sum(item["certain"] for item in drift["each"])
            console.say(
                f"significant drift of the barycentre from the first set of visits to the last: at {moved} of {len(drift['each'])} poses"
            )
        for remark in document["remarks"]:
            console.say(remark)
        if self.out is not None:
            console.say(f"wrote {self.out / 'report.html'}")
        console.finish(
            document,
            f"flexcal certificate {quoted(self.robot)} --targets TARGETS.csv --before BEFORE.csv --after AFTER.csv, once commands are "
            "compensated",
        )
