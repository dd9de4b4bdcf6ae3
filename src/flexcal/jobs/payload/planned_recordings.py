"""Joint logs given as files or as folders of trajectory plans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from flexcal.data.experiments import PLAN, existing_file, labels
from flexcal.data.plans import TrajectoryPlan, read_plan_of
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel


@dataclass(frozen=True)
class PlannedLogs:
    """Paths `files` of joint logs; for those in folders the `plans`, which define how torque is sampled, and their `plan_files`."""

    files: tuple[Path, ...]
    plans: tuple[TrajectoryPlan, ...]
    plan_files: tuple[Path, ...]

    @classmethod
    def of(cls, paths: Sequence[Path]) -> PlannedLogs:
        """Logs from files, and from folders written by 'measure'; raises `InputError` for a folder without trajectories."""
        files: list[Path] = []
        plans: list[TrajectoryPlan] = []
        plan_files: list[Path] = []
        for path in paths:
            if path.is_dir():
                plan_files.append(path / PLAN)
                plans.append(read_plan_of(path / PLAN, TrajectoryPlan))
                files += [existing_file(path, label.name) for label in labels(plans[-1])]
            else:
                files.append(path)
        return cls(tuple(files), tuple(plans), tuple(plan_files))


def with_planned_torque(model: RobotModel, plans: Sequence[TrajectoryPlan]) -> RobotModel:
    """Robot with `dynamics: tau:` as in the plans; raises `InputError` if these differ."""
    torques = sorted({plan.torque for plan in plans})
    if len(torques) > 1:
        raise InputError(
            "E-RUN-072",
            f"these folders have torques that are '{torques[0]}' and '{torques[1]}' over a sample; give recordings of one kind.",
        )
    if not torques:
        return model
    dynamics = replace(model.config.dynamics, torque=torques[0])
    return replace(model, config=replace(model.config, dynamics=dynamics))
