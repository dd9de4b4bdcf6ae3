"""Planning the motions that tell what the links weigh."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexcal.data import TrajectoryPlan, write_plan
from flexcal.design import design_trajectories
from flexcal.model import RobotModel

TRAJECTORIES = 3
CANDIDATES_EACH = 20


@dataclass(frozen=True, eq=False)
class DesignedTrajectories:
    """A plan and the file it was written to."""

    plan: TrajectoryPlan
    file: Path

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        plan = self.plan
        return {
            "plan": self.file,
            "trajectories": len(plan),
            "harmonics": plan.sine.shape[2],
            "base_frequency_hz": plan.base_frequency_hz,
            "periods": plan.periods,
            "payload": plan.payload,
            "seconds_on_the_robot": len(plan) * plan.duration,
            "seed": plan.seed,
        }


def plan_trajectories(
    robot: Path, out: Path, *, count: int = TRAJECTORIES, seed: int = 0
) -> DesignedTrajectories:
    """Write `count` exciting trajectories of the nominal robot, without its payload, to the file `out`.

    Raises `FlexcalError` where the robot declares no controller, or too few random trajectories keep its limits and touch nothing.
    """
    plan = exciting_plan(RobotModel.from_yaml(robot, estimates=False), count=count, seed=seed)
    write_plan(out, plan)
    return DesignedTrajectories(plan, out)


def exciting_plan(nominal: RobotModel, *, count: int = TRAJECTORIES, seed: int) -> TrajectoryPlan:
    """The `count` trajectories without payload that tell most, out of twenty times as many random ones."""
    payload = None if nominal.payload is None else 0.0
    return design_trajectories(nominal, count, candidates=CANDIDATES_EACH * count, seed=seed, payload=payload)
