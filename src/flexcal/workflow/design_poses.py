"""Choosing the poses to measure, for a calibration or for its verification."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data import PosePlan, PosePool, read_pose_pool, write_plan
from flexcal.design import (
    CriterionName,
    MeasuringSetup,
    PoseCurve,
    PoseDesign,
    design_poses,
    pose_curve,
    random_poses,
)
from flexcal.model import RobotModel
from flexcal.progress import Progress, silent
from flexcal.units import MILLIMETRE
from flexcal.workflow.results import identifiability_block

VERIFICATION = "verification"
"""Name of a plan of random poses."""


@dataclass(frozen=True, eq=False)
class DesignedPoses:
    """A plan, the file it was written to, for calibration poses why these, and the pool they were chosen from."""

    plan: PosePlan
    file: Path
    design: PoseDesign | None = None
    curve: PoseCurve | None = None
    pool: PosePool | None = None

    def document(self) -> dict[str, Any]:
        """The JSON document; `chosen` are the poses' numbers in the file they come from, `flank_not_sure` those left out there."""
        result: dict[str, Any] = {"plan": self.file, "poses": len(self.plan), "seed": self.plan.seed}
        design, curve = self.design, self.curve
        if design is None or curve is None:
            return result
        flanks = {
            joint: {"positive": int(np.sum(side > 0)), "negative": int(np.sum(side < 0))}
            for joint, side in zip(design.flank_joints, design.flank.T, strict=True)
        }
        if self.pool is not None:
            result["chosen"] = design.numbers
            result["flank_not_sure"] = np.setdiff1d(self.pool.pose, design.candidates.pose)
        return result | {
            "criterion": design.criterion.name,
            "candidates": len(design.candidates),
            "tool_error_mm": design.tool_error / MILLIMETRE,
            "criteria": design.criteria,
            "identifiability": identifiability_block(design.identifiability),
            "flanks": flanks,
            "enough_poses": curve.enough(),
            "curve": [
                {"poses": int(n), "tool_error_mm": float(c) / MILLIMETRE, "random_mm": float(r) / MILLIMETRE}
                for n, c, r in zip(curve.counts, curve.chosen, curve.random, strict=True)
            ],
        }


def plan_calibration_poses(
    robot: Path,
    out: Path,
    count: int,
    *,
    criterion: CriterionName = "c",
    candidates: int | Path = 4000,
    payload: float | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> DesignedPoses:
    """Choose `count` poses for the calibration of the robot as it is known, and write the plan to `out`.

    `candidates`: so many random poses to choose from, or a file of poses. `payload` in kg, None for the file's, else the declared one.
    Raises `FlexcalError` as `design_poses` and `read_pose_pool` do.
    """
    model = RobotModel.from_yaml(robot)
    choice = read_pose_pool(candidates, model) if isinstance(candidates, Path) else candidates
    design = design_poses(
        model,
        count,
        rng=np.random.default_rng([seed, 2]),
        criterion=criterion,
        candidates=choice,
        setup=MeasuringSetup(payload=payload),
        progress=progress,
    )
    curve = pose_curve(design, rng=np.random.default_rng([seed, 5]), progress=progress)
    plan = replace(design.plan, name="calibration")
    write_plan(out, plan)
    return DesignedPoses(plan, out, design, curve, choice if isinstance(choice, PosePool) else None)


def plan_verification_poses(
    robot: Path, out: Path, count: int, *, payload: float | None = None, seed: int = 0
) -> DesignedPoses:
    """Draw `count` random poses over the whole workspace, for a verification, and write the plan to `out`."""
    model = RobotModel.from_yaml(robot)
    plan = random_poses(model, count, np.random.default_rng([seed, 4]), MeasuringSetup(payload=payload))
    plan = replace(plan, name=VERIFICATION)
    write_plan(out, plan)
    return DesignedPoses(plan, out)
