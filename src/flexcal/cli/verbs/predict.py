"""`flexcal predict`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flexcal.cli.arguments.shared_options import Estimates, Json, Robot, Temperature, require_robot
from flexcal.cli.arguments.suggested_commands import estimates_option, temperature_option
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted


@dataclass(frozen=True)
class Predict:
    """Predict the pose of the real tool for given motor commands: geometry, deflection under the payload, backlash.

    The inverse of 'flexcal compensate', whose commands it reads: pose, q1, q2 and so on; payload, temperature and target are
    optional. It writes x, y, z and qw, qx, qy, qz in the base frame, which 'flexcal compensate' reads.
    """

    robot: Robot
    commands: Annotated[Positional[Path], arg(metavar="COMMANDS", help="file of commands (CSV or Parquet)")]
    out: Annotated[Path, arg(metavar="FILE", aliases=["-o"])] = Path("tool.csv")
    """File for the tool's poses (CSV or Parquet)."""
    temperature: Temperature = None
    estimates: Estimates = None
    json: Json = False

    def run(self) -> None:
        """Predict, and print the distance from the nominal robot's tool."""
        from flexcal.jobs.deployment import predict_robot

        require_robot(self.robot, self.commands)
        console = Console(self.json)
        with console.progress() as progress:
            prediction = predict_robot(
                self.robot,
                self.commands,
                self.out,
                estimates=self.estimates,
                temperature=self.temperature,
                progress=progress,
            )
        document = prediction.document()
        beside = document["beside_nominal"]
        console.say(
            f"distance of the tool from that of the nominal robot: mean {beside['mean_mm']:.3f} mm, max {beside['max_mm']:.3f} mm"
        )
        if document["ambiguous_poses"]:
            listed = len(document["ambiguous_poses"])
            console.say(f"in {listed} poses the flank of a backlash is uncertain: ambiguous_poses in --json")
        for remark in document["remarks"]:
            console.say(remark)
        console.say(f"wrote {self.out}: {document['poses']} poses of the tool in the base frame")
        where = temperature_option(self.temperature) + estimates_option(self.estimates)
        console.finish(
            document,
            f"flexcal compensate {quoted(self.robot)} TARGETS.csv{where}, for commands that bring the tool to its targets",
        )
