"""`flexcal export lerobot`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flexcal.cli.arguments.shared_options import Estimates, Json, Paths, Robot, Texts, require_robot
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted


@dataclass(frozen=True)
class ExportLerobot:
    """Write LeRobot's calibration of the motors with the joint zeros of a calibrated robot; every other character stays.

    LeRobot's zero of a motor is the middle of its range, so ranges get another middle, and become shorter: no motor goes where it did not
    go before. The zeros are those with the smallest tool error without any other correction, as of 'export offsets'.

    With --verification the errors at measured poses are compared: uncorrected, with these zeros, and with the whole geometry, which only
    a URDF can hold.
    """

    robot: Robot
    calibration: Annotated[Path, arg(metavar="FILE")]
    """LeRobot's calibration (JSON), with which the poses were recorded."""
    out: Annotated[Path, arg(metavar="FILE", help="the file to write")]
    motors: Annotated[
        Texts, arg(metavar="JOINT=MOTOR...", help_behavior_hint="(default: of the same name)")
    ] = ()
    """Motors of joints with other names, or other signs and zeros: shoulder_lift=-lift+90 (degrees)."""
    verification: Annotated[Paths, arg(metavar="POSES...", help_behavior_hint="")] = ()
    """Files of measured poses outside the calibration."""
    estimates: Estimates = None
    json: Json = False

    def run(self) -> None:
        """Export, and print zeros, ranges and the verdict."""
        from flexcal.jobs.accuracy import export_motor_zeros

        require_robot(self.robot)
        console = Console(self.json)
        exported = export_motor_zeros(
            self.robot,
            self.calibration,
            self.out,
            motors=self.motors,
            verification=self.verification,
            estimates=self.estimates,
        )
        document = exported.document()
        for joint, row in document["joints"].items():
            before, after = (f"{low} to {high}" for low, high in (row["range_before"], row["range"]))
            told = (
                f"{row['offset_deg']:+.2f}°, range {after} (before {before})"
                if row["determined"]
                else "as it was"
            )
            console.say(f"{joint}, motor {row['motor']}: {told}")
        console.say(f"wrote {self.out}")
        for sentence in (exported.headline, *exported.remarks):
            console.say(sentence)
        verdict = document["zeros_or_geometry"]
        if verdict is not None and verdict["answer"] == "geometry":
            console.finish(
                document,
                f"flexcal export urdf {quoted(self.robot)} --out calibrated.urdf, beside LeRobot's old file",
            )
            return
        console.finish(
            document, f"put {self.out} in place of {self.calibration}, and let LeRobot write it to the motors"
        )
