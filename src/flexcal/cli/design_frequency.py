"""`flexcal design frequency`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from flexcal.cli.console import Console
from flexcal.cli.next_step import measuring
from flexcal.cli.options import Json, Robot, require_at_least, require_robot


@dataclass(frozen=True)
class DesignFrequency:
    """Plan the frequency experiments: odd random-phase multisines on every elastic axis, under a slow reference motion."""

    robot: Robot
    out: Annotated[Path, arg(metavar="FILE")] = Path("frequency.yaml")
    """File for the plan."""
    plan: Literal["default", "paper"] = "default"
    """default: payload as declared, 1.5° of reference motion; paper: no payload, 3°."""
    poses: Annotated[
        Path | None,
        arg(metavar="FILE", help_behavior_hint="(default: frequency_poses.csv beside robot.yaml)"),
    ] = None
    """Where to excite: CSV with plan, pose, q1_deg, q2_deg and so on."""
    crest: Literal["random", "optimised"] = "random"
    """Phases as drawn, or shifted from there so that the torque's peaks are small."""
    detection_lines: bool = False
    """Leave out one line in four; what is seen there is the robot's odd nonlinear distortion."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Of the random phases."""
    json: Json = False

    def run(self) -> None:
        """Plan, and print how long it takes."""
        from flexcal.workflow.design_frequency import plan_frequency_experiments

        require_robot(self.robot)
        require_at_least(0, seed=self.seed)
        console = Console(self.json)
        document = plan_frequency_experiments(
            self.robot,
            self.out,
            kind=self.plan,
            poses=self.poses,
            crest=self.crest,
            detection_lines=self.detection_lines,
            seed=self.seed,
        ).document()
        console.say(
            f"wrote {self.out}: {document['poses']} poses, {document['lines']} lines from {document['lowest_hz']:g} to "
            f"{document['highest_hz']:g} Hz, {document['recordings']} recordings, "
            f"{document['seconds_on_the_robot'] / 60:.0f} minutes on a real robot"
        )
        console.finish(document, f"{measuring(self.out, self.robot, 'frequency')}, or record it on the robot")
