"""Planning the frequency experiments of a robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from flexcal.data import MultisinePlan, write_plan
from flexcal.errors import InputError
from flexcal.frequency import leave_out_detection_lines
from flexcal.model import RobotModel
from flexcal.workflow.frequency_plans import frequency_plan


@dataclass(frozen=True, eq=False)
class DesignedFrequency:
    """A plan and the file it was written to."""

    plan: MultisinePlan
    file: Path

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        plan = self.plan
        recordings = len(plan.poses) * plan.recordings_per_pose
        return {
            "plan": self.file,
            "poses": len(plan.poses),
            "excited_axes": [joint + 1 for joint in plan.joints],
            "lines": len(plan.lines),
            "detection_lines": len(plan.detection_lines),
            "lowest_hz": float(plan.frequencies_hz[0]),
            "highest_hz": float(plan.frequencies_hz[-1]),
            "recordings": recordings,
            "seconds_on_the_robot": recordings * plan.duration,
            "seed": plan.seed,
        }


def plan_frequency_experiments(
    robot: Path,
    out: Path,
    *,
    kind: Literal["default", "paper"] = "default",
    poses: Path | None = None,
    crest: Literal["random", "optimised"] = "random",
    detection_lines: bool = False,
    seed: int = 0,
) -> DesignedFrequency:
    """Write the plan `kind` for a robot to `out`; `poses` (default: frequency_poses.csv beside robot.yaml) lists where to excite.

    `crest`: random phases, or ones with small peaks; with `detection_lines` one line in four is left out, to see odd distortion.

    Raises `FlexcalError` where the robot declares no elastic joint or no controller, or the poses cannot be read.
    """
    model = RobotModel.from_yaml(robot)
    if not model.elastic:
        raise InputError(f"{robot} declares no elastic joint, so there is nothing to excite; add `elastic:`.")
    beside = model.path.parent / "frequency_poses.csv"
    plan = replace(frequency_plan(model, beside if poses is None else poses, kind, seed), crest=crest)
    if detection_lines:
        plan = leave_out_detection_lines(plan)
    write_plan(out, plan)
    return DesignedFrequency(plan, out)
