"""`flexcal verify`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Estimates,
    Json,
    MaybePath,
    PoseFiles,
    Robot,
    Temperature,
    any_number,
    require_robot_and_files,
)
from flexcal.cli.arguments.suggested_commands import estimates_option
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted
from flexcal.units import decimals

if TYPE_CHECKING:
    from flexcal.report.layout import Status


@dataclass(frozen=True)
class Verify:
    """Verify a calibration on measured positions outside the fit."""

    robot: Robot
    poses: PoseFiles
    estimates: Estimates = None
    refit: Annotated[
        tuple,
        any_number("{station,point}...", choices=("station", "point")),
        arg(metavar="{station,point}...", help_behavior_hint="(default: nothing)"),
    ] = ()
    """Fit the placement of the instrument, or the measured point, to these poses, where it was moved or replaced since the
    calibration; the geometry is kept. Errors are then leave-one-out errors."""
    temperature: Temperature = None
    out: Annotated[MaybePath, arg(metavar="DIR", help_behavior_hint="(default: none)")] = None
    """Folder for report.html, results.json and points.csv; without it there is no report."""
    json: Json = False

    def run(self) -> None:
        """Verify, and print the errors."""
        from flexcal.cli.tables.results import error_table, orientation_table, uncalibrated_rows
        from flexcal.jobs.accuracy import verify_robot

        require_robot_and_files(self.robot, self.poses, "POSES")
        console = Console(self.json)
        with console.progress() as progress:
            verification = verify_robot(
                self.robot,
                self.poses,
                estimates=self.estimates,
                refit=tuple(dict.fromkeys(self.refit)),
                temperature=self.temperature,
                out=self.out,
                command=command_line(),
                progress=progress,
            )
        document = verification.document()
        blocks = document["verification"]
        labels = {"measured": "calibrated"}
        if document["refit"] is not None:
            labels = {
                "as_calibrated": "calibrated, nothing refitted",
                "measured": f"calibrated, {' and '.join(document['refit']['what'])} refitted (leave-one-out)",
            }
        if document["ambiguous_poses"]:
            labels["measured_unambiguous"] = "calibrated, flank certain"
        held = bool(verification.poses.in_socket.any())
        rows = uncalibrated_rows(document, held=held) | {
            label: blocks[key] for key, label in labels.items() if key in blocks
        }
        rms = document["rms_mm"]
        title = "distance of the ball from its socket" if held else "distance to the measured points"
        console.show(error_table(title, rows, rms["expected"]))
        if document["orientation"] is not None:
            console.show(orientation_table(document["orientation"]))
        digits = decimals(rms["expected"])
        whole = (
            "; noise of instrument and robot is not known"
            if rms["expected"] is None
            else f", {rms['expected']:.{digits}f} mm with instrument, robot and model error"
        )
        console.say(
            f"root mean square: {rms['measured']:.{digits}f} mm; predicted from the parameters' covariance: "
            f"{rms['parameters']:.{digits}f} mm{whole}"
        )
        for remark in document["remarks"]:
            console.say(remark)
        console.say(verification.trust.sentence)
        if self.out is not None:
            console.say(f"wrote {self.out / 'report.html'}")
        console.finish(document, self._next(verification.trust.status, verification.trust.reasons, held=held))

    def _next(self, status: Status, reasons: Sequence[str], *, held: bool) -> str:
        """The next step after a verdict; `held`: of a ball in sockets."""
        robot, where = quoted(self.robot), estimates_option(self.estimates)
        if status == "bad":
            return "mend what the verdict names, and verify again; do not use this calibration before that"
        if status == "care" and not {"improvement", "worsening"}.isdisjoint(reasons):
            return f"flexcal calibrate {robot} MORE_POSES…: these poses do not show that the calibration makes the robot more accurate"
        if status == "unknown":
            return f"flexcal verify {robot} MORE_POSES…{where} (flexcal design poses --random plans some)"
        verified = "" if held else f" --verification {quoted(self.poses[0])}"
        return (
            f"flexcal export urdf {robot}{where} --out calibrated.urdf, or flexcal compensate {robot} TARGETS.csv{where}; "
            f"flexcal map {robot}{where}{verified} predicts the accuracy elsewhere"
        )
