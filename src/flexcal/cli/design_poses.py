"""`flexcal design poses`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from flexcal.cli.console import Console
from flexcal.cli.next_step import measuring
from flexcal.cli.options import Json, Robot, require_at_least, require_robot
from flexcal.errors import InputError


@dataclass(frozen=True)
class DesignPoses:
    """Choose the poses that tell most about the robot's geometric errors, within joint limits, free of collision, seen by the instrument.

    With --from, out of the poses of a file; for a verification, --random draws poses all over the workspace instead.
    """

    robot: Robot
    count: Annotated[int, arg(metavar="N")] = 40
    """Number of poses."""
    out: Annotated[Path, arg(metavar="FILE")] = Path("poses.yaml")
    """File for the plan."""
    pool: Annotated[
        Path | None, arg(name="from", metavar="FILE", help_behavior_hint="(default: random poses)")
    ] = None
    """CSV or Parquet with pose, q1, q2 and so on to choose from: poses taught on the robot, or measured before."""
    random: bool = False
    """Random poses, for a verification; criterion and candidates do not count then."""
    criterion: Literal["c", "A", "D", "E", "O1", "O2", "O3", "O4", "O5"] = "c"
    """c: least predicted tool error; A, D, E: of the parameters' covariance; O1-O5: observability indices."""
    candidates: Annotated[int, arg(metavar="N")] = 4000
    """Random poses to choose from, without --from."""
    payload: Annotated[
        float | None, arg(metavar="KG", help_behavior_hint="(default: as robot.yaml declares)")
    ] = None
    """Payload held in the poses, kg."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Of the random poses."""
    json: Json = False

    def run(self) -> None:
        """Choose, and print how good the choice is."""
        from flexcal.workflow.design_poses import plan_calibration_poses, plan_verification_poses

        require_robot(self.robot)
        require_at_least(1, count=self.count, candidates=self.candidates)
        require_at_least(0, seed=self.seed, payload=self.payload)
        console = Console(self.json)
        if self.random and self.pool is not None:
            raise InputError("--random draws poses and --from chooses given ones; keep one of them.")
        if self.random:
            drawn = plan_verification_poses(
                self.robot, self.out, self.count, payload=self.payload, seed=self.seed
            )
            console.say(f"wrote {self.out}: {self.count} random poses")
            console.finish(
                drawn.document(),
                f"{measuring(self.out, self.robot, 'unseen')}, or measure them on the robot",
            )
            return
        with console.progress() as progress:
            found = plan_calibration_poses(
                self.robot,
                self.out,
                self.count,
                criterion=self.criterion,
                candidates=self.candidates if self.pool is None else self.pool,
                payload=self.payload,
                seed=self.seed,
                progress=progress,
            )
        document = found.document()
        seen = document["identifiability"]
        console.say(
            f"{seen['rank']} of {seen['parameters']} parameters can be told apart by position measurements"
        )
        console.say(
            f"predicted tool error from tracker noise alone: {document['tool_error_mm']:.4f} mm (rms over the workspace); "
            f"from {document['enough_poses']} poses on it falls by averaging only"
        )
        others = {name: value for name, value in document["criteria"].items() if name != "c"}
        console.say("criteria: " + ", ".join(f"{name} {value:.4g}" for name, value in others.items()))
        if self.pool is not None:
            console.say(f"chosen from {self.pool}: {', '.join(map(str, document['chosen']))}")
            unsure = document["flank_not_sure"]
            if len(unsure):
                console.say(
                    f"{len(unsure)} poses were left out, for gravity does not surely settle the flank of a backlash there"
                )
        for joint, sides in document["flanks"].items():
            console.say(
                f"{joint}: {sides['positive']} poses on one flank of its backlash, {sides['negative']} on the other"
            )
        console.say(f"wrote {self.out}: {self.count} poses")
        console.finish(
            document,
            f"{measuring(self.out, self.robot, 'measured')}, or measure them on the robot",
        )
