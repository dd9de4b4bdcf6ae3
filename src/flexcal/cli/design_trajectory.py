"""`flexcal design trajectory`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flexcal.cli.console import Console
from flexcal.cli.next_step import measuring
from flexcal.cli.options import Json, Robot, require_at_least, require_robot


@dataclass(frozen=True)
class DesignTrajectory:
    """Plan exciting trajectories: periodic motions of all joints that keep the limits, touch nothing and tell most of the links."""

    robot: Robot
    out: Annotated[Path, arg(metavar="FILE")] = Path("trajectory.yaml")
    """File for the plan."""
    count: Annotated[int, arg(metavar="N")] = 3
    """Trajectories; the best of twenty times as many random ones."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Of the random trajectories."""
    json: Json = False

    def run(self) -> None:
        """Plan, and print how long it takes."""
        from flexcal.workflow.design_trajectory import plan_trajectories

        require_robot(self.robot)
        require_at_least(1, count=self.count)
        require_at_least(0, seed=self.seed)
        console = Console(self.json)
        document = plan_trajectories(self.robot, self.out, count=self.count, seed=self.seed).document()
        without = "" if document["payload"] is None else ", without the payload"
        console.say(
            f"wrote {self.out}: {document['trajectories']} trajectories of {document['periods']} periods of "
            f"{1 / document['base_frequency_hz']:g} s{without}, {document['seconds_on_the_robot']:.0f} s on a real robot"
        )
        console.finish(document, f"{measuring(self.out, self.robot, 'exciting')}, or record it on the robot")
