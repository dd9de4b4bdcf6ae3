"""`flexcal compensate`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from flexcal.cli.arguments.shared_options import (
    Estimates,
    Json,
    MaybeText,
    Numbers,
    Robot,
    Temperature,
    require_robot,
)
from flexcal.cli.arguments.suggested_commands import estimates_option, temperature_option
from flexcal.cli.terminal.console import Console
from flexcal.cli.verbs.calibrate import undetermined_point_remark
from flexcal.printable import quoted
from flexcal.units import MILLIMETRE

_LISTED = 10


def _point_words(name: str, point: Mapping[str, Any]) -> str:
    """The compensated point, its position, and the option that selects another one."""
    if point["found_xyz_m"] is None:
        what = f"the frame {name}" if name == point["frame"] else f"the point '{name}' in {point['frame']}"
        return (
            f"{what} is brought to the targets; it was not measured, and what the measured points do not determine of it "
            "(position along and about the last axis, orientation) stays nominal"
        )
    calibrated, declared = (point[key] for key in ("found_xyz_m", "declared_xyz_m"))
    off = float(sum((a - b) ** 2 for a, b in zip(calibrated, declared, strict=True)) ** 0.5) / MILLIMETRE
    place = ", ".join(f"{value:.5f}" for value in calibrated)
    return (
        f"the point '{name}' is brought to the targets: calibrated position [{place}] m in {point['frame']}, {off:.2f} mm from the "
        f"declared one; --frame {point['frame']} takes that frame instead"
    )


@dataclass(frozen=True)
class Compensate:
    """Compute motor commands that bring the real tool to given targets, compensating geometry, deflection under the payload and backlash.

    TARGETS has the column pose, and q1, q2 and so on: the nominal commands, which define the target pose of the tool and the configuration
    of the arm; or x, y, z in the base frame, with qw, qx, qy, qz if the orientation matters; or both. payload, temperature and
    target are optional.

    A target that cannot be reached is left out of the commands and listed with the reason; the others are written.
    """

    robot: Robot
    targets: Annotated[Positional[Path], arg(metavar="TARGETS", help="file of targets (CSV or Parquet)")]
    out: Annotated[Path, arg(metavar="FILE", aliases=["-o"])] = Path("commands.csv")
    """File for the commands (CSV or Parquet)."""
    estimates: Estimates = None
    target: Annotated[
        MaybeText,
        arg(metavar="NAME", help_behavior_hint="(default: the column target, else the first point)"),
    ] = None
    """Point under `points:` that is brought to the targets."""
    frame: Annotated[MaybeText, arg(metavar="FRAME", help_behavior_hint="(default: a point)")] = None
    """URDF frame, such as tool0, whose origin is brought to the targets, in place of a point under `points:`."""
    temperature: Temperature = None
    start: Annotated[
        Numbers, arg(metavar="Q...", help_behavior_hint="(default: a posture far from singular)")
    ] = ()
    """Start of the inverse kinematics (joint positions, rad or m) for targets without q1, q2 and so on; determines the configuration."""
    json: Json = False

    def run(self) -> None:
        """Compensate, and print the error before and the targets that cannot be reached."""
        from flexcal.jobs.deployment import compensate_robot

        require_robot(self.robot, self.targets)
        console = Console(self.json)
        with console.progress() as progress:
            compensation = compensate_robot(
                self.robot,
                self.targets,
                self.out,
                estimates=self.estimates,
                target=self.target,
                frame=self.frame,
                start=self.start,
                temperature=self.temperature,
                progress=progress,
            )
        document = compensation.document()
        if document["start"] is not None:
            listed = ", ".join(f"{joint} {value:.4g}" for joint, value in document["start"].items())
            console.say(
                f"start of the inverse kinematics for targets without joint positions: {listed} (rad or m; --start)"
            )
        if document["from_other_postures"]:
            console.say(
                f"{len(document['from_other_postures'])} of them were reached from another start only, where the arm may be in another "
                "configuration: from_other_postures in --json"
            )
        for name, std in document["points_not_found_m"].items():
            console.say(undetermined_point_remark(compensation.model, name, std))
        for name, point in document["points"].items():
            console.say(_point_words(name, point))
        before = document["error_before_mm"]
        console.say(
            f"position error with nominal commands: {before['mean_mm']:.3f} mm on average, {before['max_mm']:.3f} mm at most"
        )
        if document["ambiguous"]:
            console.say(
                f"at {document['ambiguous']} commands the flank of a backlash is uncertain: unambiguous is false there"
            )
        for item in document["refused"][:_LISTED]:
            place = ", ".join(f"{key} {item[key]}" for key in ("pose", "line", "row") if key in item)
            console.say(f"left out: {place}: {item['reason']}")
        if len(document["refused"]) > _LISTED:
            console.say(
                f"left out: {len(document['refused']) - _LISTED} more, with their reasons under refused in --json"
            )
        for remark in document["remarks"]:
            console.say(remark)
        console.say(
            f"wrote {self.out}: commands for {document['compensated']} of {document['targets']} targets"
        )
        where = estimates_option(self.estimates)
        robot, measured = quoted(self.robot), f"MEASURED.csv{temperature_option(self.temperature)}{where}"
        console.finish(
            document,
            f"run {self.out} on the robot, measure it, and flexcal verify {robot} {measured}; with the nominal commands "
            f"measured too, flexcal certificate {robot} --targets {quoted(self.targets)} --before NOMINAL.csv --after {measured}",
        )
