"""Selection of calibration or verification poses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.plans import PosePlan, page_beside, write_plan
from flexcal.data.poses import PosePool
from flexcal.design.poses import (
    MeasurementOrder,
    PoseCurve,
    PoseDesign,
    WorkingVolume,
    choose_poses,
    fewest_poses,
    measurement_order,
    pose_curve,
    random_poses,
)
from flexcal.design.scene import MeasuringSetup
from flexcal.jobs.experiments.candidate_poses import CandidatePoses, PoseRequest
from flexcal.jobs.inputs import robot_provenance
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, identifiability_block
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.layout import write_page
from flexcal.report.pages import PoseStudy, pose_page
from flexcal.units import MILLIMETRE

VERIFICATION = "verification"
"""Name of a plan of random poses."""


@dataclass(frozen=True, eq=False)
class DesignedPoses:
    """A plan of random poses for a verification, its file, the seed they were drawn with, and what it comes from."""

    plan: PosePlan
    file: Path
    seed: int
    record: RunRecord

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "plan": self.file,
            "poses": len(self.plan),
            "seed": self.seed,
            **self.record.document(),
        }


@dataclass(frozen=True, eq=False)
class CalibrationPosePlan:
    """A plan of calibration poses, its file, why these, the way through them, and where the robot will work (None: anywhere).

    `pool` are the given poses they were chosen from, if any; else `seed` drew the random ones. `record` says what the plan comes from.
    """

    plan: PosePlan
    file: Path
    design: PoseDesign
    curve: PoseCurve
    way: MeasurementOrder
    seed: int
    working: WorkingVolume | None = None
    pool: PosePool | None = None
    record: RunRecord = NOT_RECORDED

    def document(self) -> dict[str, Any]:
        """The JSON document; `chosen` are the poses' numbers in the file they come from; those left out there stand beside, with why.

        Moves in `blocked_moves` are pairs of poses of the plan, counted from 1.
        """
        design, curve = self.design, self.curve
        return (
            {"plan": self.file, "poses": len(self.plan)}
            | pool_block(design, self.pool, self.seed)
            | {
                "criterion": design.criterion.name,
                "candidates": len(design.candidates),
                "tool_error_mm": design.tool_error / MILLIMETRE,
                "least_possible_mm": design.least_possible / MILLIMETRE,
                "working": working_block(self.working),
                "criteria": design.criteria,
                "identifiability": identifiability_block(design.identifiability),
                "flanks": flank_block(design),
                "moves_s": float(self.way.seconds.sum()),
                "blocked_moves": [[int(i) + 1, int(i) + 2] for i in np.flatnonzero(self.way.blocked)],
                "enough_poses": curve.enough(),
                "curve": [
                    {
                        "poses": int(n),
                        "tool_error_mm": float(c) / MILLIMETRE,
                        "random_mm": float(r) / MILLIMETRE,
                    }
                    for n, c, r in zip(curve.counts, curve.chosen, curve.random, strict=True)
                ],
                **self.record.document(),
            }
        )


def pool_block(design: PoseDesign, pool: PosePool | None, seed: int) -> dict[str, Any]:
    """Which poses of a given pool were chosen, and which could not be; without one, the seed of the random poses."""
    if pool is None:
        return {"seed": seed}
    left_out = np.setdiff1d(pool.pose, design.candidates.pose)
    drawn = {} if pool.among is None else {"drawn": {"considered": len(pool), "among": pool.among}}
    return {
        "seed": None,
        "chosen": design.numbers,
        "flank_not_sure": np.setdiff1d(left_out, design.hidden),
        "not_seen": design.hidden,
        **drawn,
    }


def flank_block(design: PoseDesign) -> dict[str, dict[str, int]]:
    """How many poses press each backlash onto which flank."""
    return {
        joint: {"positive": int(np.sum(side > 0)), "negative": int(np.sum(side < 0))}
        for joint, side in zip(design.flank_joints, design.flank.T, strict=True)
    }


def working_block(working: WorkingVolume | None) -> dict[str, Any] | None:
    """Where the tool error counts; None for anywhere."""
    if working is None:
        return None
    return {"poses": len(working.q), "reached_share": working.reached, "box_m": working.box}


def plan_calibration_poses(
    robot: Path,
    out: Path,
    request: PoseRequest,
    *,
    command: str = "",
    progress: Progress = silent,
) -> CalibrationPosePlan:
    """Choose poses for the calibration of the robot as it is known, and write the plan to `out`, its page beside it.

    The poses are in an order of short moves; where a tool error is wanted, only as many as bring the predicted one down to it. Raises
    `FlexcalError` as `select_poses`, `fewest_poses`, `read_pose_pool` and `working_volume` do.
    """
    model, seed, count = RobotModel.from_yaml(robot), request.seed, request.count
    rng = np.random.default_rng([seed, 2])
    choice = CandidatePoses.of(model, request, rng, progress)
    if request.wanted is not None:
        count = fewest_poses(choice.candidates, count, request.wanted)
    design = choose_poses(choice.candidates, count, rng=rng, criterion=request.criterion, progress=progress)
    way = measurement_order(choice.checker, design.plan.q)
    design = design.in_order(way.order)
    curve = pose_curve(design, rng=np.random.default_rng([seed, 5]), progress=progress)
    plan = replace(design.plan, name="calibration")
    origin = robot_provenance(model, choice.files)
    result = CalibrationPosePlan(
        plan, out, design, curve, way, seed, choice.working, choice.pool, RunRecord(origin, command)
    )
    write_pose_plan(out, model, plan, result.document(), choice.working)
    return result


def plan_verification_poses(
    robot: Path, out: Path, count: int, *, payload: float | None = None, seed: int = 0, command: str = ""
) -> DesignedPoses:
    """Draw `count` random poses over the whole workspace, for a verification, and write the plan to `out`, and its page beside it."""
    model = RobotModel.from_yaml(robot)
    setup = MeasuringSetup.declared(model, payload)
    plan = random_poses(model, count, np.random.default_rng([seed, 4]), setup)
    plan = replace(plan, name=VERIFICATION)
    result = DesignedPoses(plan, out, seed, RunRecord(robot_provenance(model), command))
    write_pose_plan(out, model, plan, result.document(), None)
    return result


def write_pose_plan(
    out: Path, model: RobotModel, plan: PosePlan, document: dict[str, Any], working: WorkingVolume | None
) -> None:
    """Write a plan to `out`, and its page beside it."""
    write_plan(out, plan)
    study = PoseStudy(model, plan.q, document)
    if working is not None:
        study = replace(study, working=working.points, box=working.box)
    write_page(page_beside(out), pose_page(study))
