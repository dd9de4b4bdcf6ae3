"""Choosing the poses to measure, for a calibration or for its verification."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data import PosePlan, write_plan
from flexcal.design import CriterionName, PoseCurve, PoseDesign, design_poses, pose_curve, random_poses
from flexcal.model import RobotModel
from flexcal.units import MILLIMETRE
from flexcal.workflow.results import identifiability_block

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class DesignedPoses:
    """A plan, the file it was written to, and for calibration poses why these."""

    plan: PosePlan
    file: Path
    design: PoseDesign | None = None
    curve: PoseCurve | None = None

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        result: dict[str, Any] = {"plan": self.file, "poses": len(self.plan), "seed": self.plan.seed}
        design, curve = self.design, self.curve
        if design is None or curve is None:
            return result
        flanks = {
            joint: {"positive": int(np.sum(side > 0)), "negative": int(np.sum(side < 0))}
            for joint, side in zip(design.flank_joints, design.flank.T, strict=True)
        }
        return result | {
            "criterion": design.criterion.name,
            "candidates": len(design.candidates),
            "tool_error_mm": design.tool_error / MILLIMETRE,
            "observability": asdict(design.observability) | {"sigma_min": design.observability.sigma_min},
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
    candidates: int = 4000,
    payload: float | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> DesignedPoses:
    """Choose `count` poses for the calibration of the robot as it is known, and write the plan to `out`.

    `payload` in kg, None for the declared one. Raises `FlexcalError` as `design_poses` does.
    """
    tell = progress or (lambda stage, share: None)
    model = RobotModel.from_yaml(robot)
    tell("choosing", 0.0)
    rng = np.random.default_rng([seed, 2])
    design = design_poses(model, count, rng=rng, criterion=criterion, candidates=candidates, payload=payload)
    tell("choosing", 1.0)
    tell("how many", 0.0)
    curve = pose_curve(design, rng=np.random.default_rng([seed, 5]))
    tell("how many", 1.0)
    plan = replace(design.plan, name="calibration")
    write_plan(out, plan)
    return DesignedPoses(plan, out, design, curve)


def plan_verification_poses(
    robot: Path, out: Path, count: int, *, payload: float | None = None, seed: int = 0
) -> DesignedPoses:
    """Draw `count` random poses over the whole workspace, for a verification, and write the plan to `out`."""
    model = RobotModel.from_yaml(robot)
    plan = random_poses(model, count, np.random.default_rng([seed, 4]), payload=payload)
    plan = replace(plan, name="verification")
    write_plan(out, plan)
    return DesignedPoses(plan, out)
