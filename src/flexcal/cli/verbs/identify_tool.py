"""`flexcal identify tool`."""

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


@dataclass(frozen=True)
class IdentifyTool:
    """Find the tool centre point from poses in which the tip touched a fixed point, four or more in different orientations.

    A column `point` names the fixed points where there are several. With a calibration beside robot.yaml its errors count, else typical
    ones of joints. robot.yaml is not changed: copy the printed line into it.
    """

    robot: Robot
    touches: Annotated[
        Positional[Paths],
        file_argument("TOUCHES...", "poses of the touches (CSV or Parquet): q1, q2 and so on"),
    ]
    frame: Annotated[
        MaybeText, arg(metavar="FRAME", help_behavior_hint="(default: that of the first point)")
    ] = None
    """URDF frame in which the tip is sought."""
    name: Annotated[str, arg(metavar="NAME")] = "tip"
    """Name of the tip."""
    estimates: Estimates = None
    out: Annotated[MaybePath, arg(metavar="DIR", help_behavior_hint="(default: none)")] = None
    """Folder for results.json."""
    json: Json = False

    def run(self) -> None:
        """Fit, and print the tip."""
        from flexcal.jobs.tool import identify_tool

        require_robot_and_files(self.robot, self.touches, "TOUCHES")
        console = Console(self.json)
        found = identify_tool(
            self.robot,
            self.touches,
            frame=self.frame,
            name=self.name,
            estimates=self.estimates,
            out=self.out,
            command=command_line(),
        )
        for line in (found.headline, *found.remarks, *found.lines):
            console.say(line)
        if self.out is not None:
            console.say(f"wrote {self.out / 'results.json'}")
        console.finish(found.document(), f"copy the line into {self.robot}")
