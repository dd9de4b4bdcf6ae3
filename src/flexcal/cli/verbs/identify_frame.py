"""`flexcal identify frame`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Estimates,
    Json,
    MaybePath,
    MaybeText,
    Paths,
    Robot,
    file_argument,
    require_robot_and_files,
)
from flexcal.cli.terminal.console import Console
from flexcal.units import MILLIMETRE


@dataclass(frozen=True)
class IdentifyFrame:
    """Find the frame of a work object (wobj, base, user frame, plane) from poses in which the tip touched it.

    The file says what was touched: points by their coordinates in the work object's frame (wx, wy, wz, m), faces (face: 1, 2, 3, as in
    3-2-1), or points by name (point: origin, x, xy; or x1, x2, y1). The tip is a point of robot.yaml. With a calibration beside robot.yaml
    its errors count, else typical ones of joints.
    """

    robot: Robot
    touches: Annotated[
        Positional[Paths],
        file_argument(
            "TOUCHES...", "poses of the touches (CSV or Parquet): q1, q2 and so on, and what was touched"
        ),
    ]
    point: Annotated[MaybeText, arg(metavar="POINT", help_behavior_hint="(default: the first)")] = None
    """Tip, as robot.yaml names it under points."""
    name: Annotated[str, arg(metavar="NAME")] = "work_object"
    """Name of the work object."""
    tip_radius: Annotated[float, arg(metavar="MM")] = 0.0
    """Radius of a ball at the tip that touched faces."""
    estimates: Estimates = None
    out: Annotated[MaybePath, arg(metavar="DIR", help_behavior_hint="(default: none)")] = None
    """Folder for results.json."""
    json: Json = False

    def run(self) -> None:
        """Fit, and print the frame."""
        from flexcal.jobs.frame import identify_frame

        require_robot_and_files(self.robot, self.touches, "TOUCHES")
        console = Console(self.json)
        found = identify_frame(
            self.robot,
            self.touches,
            point=self.point,
            name=self.name,
            tip_radius=self.tip_radius * MILLIMETRE,
            estimates=self.estimates,
            out=self.out,
            command=command_line(),
        )
        for line in (found.headline, *found.remarks, *found.lines):
            console.say(line)
        if self.out is not None:
            console.say(f"wrote {self.out / 'results.json'}")
        console.finish(found.document(), "copy the frame into the controller")
