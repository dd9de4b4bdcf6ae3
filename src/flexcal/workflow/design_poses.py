"""Choosing the poses to measure, for a calibration or for its verification."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data import PosePlan, PosePool, read_pose_pool, read_working, write_plan
from flexcal.design import (
    CollisionChecker,
    CriterionName,
    MeasuringSetup,
    PoseCurve,
    PoseDesign,
    VisitingOrder,
    WorkingVolume,
    choose_poses,
    fewest_poses,
    pose_candidates,
    pose_curve,
    random_poses,
    visiting_order,
    working_box,
    working_points,
)
from flexcal.errors import InputError
from flexcal.model import RobotModel, point_kinematics
from flexcal.progress import Progress, silent
from flexcal.report.pose_design import PoseStudy, write_pose_page
from flexcal.units import MILLIMETRE
from flexcal.workflow.results import identifiability_block

VERIFICATION = "verification"
"""Name of a plan of random poses."""


@dataclass(frozen=True, eq=False)
class DesignedPoses:
    """A plan of random poses for a verification, and the file it was written to."""

    plan: PosePlan
    file: Path

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {"plan": self.file, "poses": len(self.plan), "seed": self.plan.seed}


@dataclass(frozen=True, eq=False)
class ChosenPoses:
    """A plan of calibration poses, its file, why these, the way through them, and where the robot will work (None: anywhere).

    `pool` are the given poses they were chosen from, if any.
    """

    plan: PosePlan
    file: Path
    design: PoseDesign
    curve: PoseCurve
    way: VisitingOrder
    working: WorkingVolume | None = None
    pool: PosePool | None = None

    def document(self) -> dict[str, Any]:
        """The JSON document; `chosen` are the poses' numbers in the file they come from; those left out there stand beside, with why.

        Moves in `blocked_moves` are pairs of poses of the plan, counted from 1.
        """
        design, curve = self.design, self.curve
        return (
            {"plan": self.file, "poses": len(self.plan), "seed": self.plan.seed}
            | pool_block(design, self.pool)
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
            }
        )


def pool_block(design: PoseDesign, pool: PosePool | None) -> dict[str, Any]:
    """Which poses of a given pool were chosen, and which could not be."""
    if pool is None:
        return {}
    left_out = np.setdiff1d(pool.pose, design.candidates.pose)
    return {
        "chosen": design.numbers,
        "flank_not_sure": np.setdiff1d(left_out, design.hidden),
        "not_seen": design.hidden,
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
    count: int,
    *,
    criterion: CriterionName = "c",
    candidates: int | Path = 4000,
    working: str | None = None,
    wanted: float | None = None,
    payload: float | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> ChosenPoses:
    """Choose `count` poses for the calibration of the robot as it is known, and write the plan to `out`, its page beside it.

    The poses are in an order of short moves.

    `candidates`: so many random poses to choose from, or a file of poses. `working`: where the tool error counts, as in `working_volume`.
    With `wanted`, m, only as many poses as bring the predicted tool error down to it. `payload` in kg, None for the file's, else the
    declared one. Raises `FlexcalError` as `design_poses`, `fewest_poses`, `read_pose_pool` and `working_volume` do.
    """
    model = RobotModel.from_yaml(robot)
    checker = CollisionChecker(model)
    place = working_volume(checker, working, seed)
    choice = read_pose_pool(candidates, model) if isinstance(candidates, Path) else candidates
    rng = np.random.default_rng([seed, 2])
    found = pose_candidates(
        model,
        rng=rng,
        candidates=choice,
        least=count,
        setup=MeasuringSetup.declared(model, payload),
        working=None if place is None else place.q,
        checker=checker,
        progress=progress,
    )
    if wanted is not None:
        count = fewest_poses(found, count, wanted)
    design = choose_poses(found, count, rng=rng, criterion=criterion, progress=progress)
    way = visiting_order(checker, design.plan.q)
    design = design.in_order(way.order)
    curve = pose_curve(design, rng=np.random.default_rng([seed, 5]), progress=progress)
    plan = replace(design.plan, name="calibration")
    pool = choice if isinstance(choice, PosePool) else None
    result = ChosenPoses(plan, out, design, curve, way, place, pool)
    write_plan(out, plan)
    write_pose_page(page_beside(out), study_of(model, plan, result.document(), place))
    return result


def plan_verification_poses(
    robot: Path, out: Path, count: int, *, payload: float | None = None, seed: int = 0
) -> DesignedPoses:
    """Draw `count` random poses over the whole workspace, for a verification, and write the plan to `out`, and its page beside it."""
    model = RobotModel.from_yaml(robot)
    setup = MeasuringSetup.declared(model, payload)
    plan = random_poses(model, count, np.random.default_rng([seed, 4]), setup)
    plan = replace(plan, name=VERIFICATION)
    result = DesignedPoses(plan, out)
    write_plan(out, plan)
    write_pose_page(page_beside(out), study_of(model, plan, result.document(), None))
    return result


def page_beside(plan: Path) -> Path:
    """The page with pictures of a plan."""
    return plan.with_suffix(".html")


def study_of(
    model: RobotModel, plan: PosePlan, document: dict[str, Any], working: WorkingVolume | None
) -> PoseStudy:
    """What the page shows."""
    if working is None:
        return PoseStudy(model, plan.q, document)
    return PoseStudy(model, plan.q, document, working.points, working.box)


def working_volume(checker: CollisionChecker, given: str | None, seed: int) -> WorkingVolume | None:
    """Where the robot will work: a box "x:X,y:Y,z:Z" (m, base frame), else a file for `read_working`, else what robot.yaml declares.

    None where nothing does. Raises `FlexcalError` for a box that is none, and what the robot does not reach.
    """
    model, rng = checker.model, np.random.default_rng([seed, 6])
    declared = model.config.working_volume
    if given is None:
        if declared is None:
            return None
        return working_box(checker, np.array(declared.lower), np.array(declared.upper), rng)
    if ":" in given:
        corners = _corners(given)
        return working_box(checker, corners[0], corners[1], rng)
    q, points = read_working(Path(given), model)
    if points is not None:
        return working_points(checker, points, rng)
    assert q is not None
    return WorkingVolume(q, point_kinematics(model, q, jacobians=False).position)


def _corners(text: str) -> np.ndarray:
    """Corners (2, 3) of "x:X,y:Y,z:Z"."""
    try:
        ranges = [[float(end) for end in part.split(":")] for part in text.split(",")]
        corners = np.array(ranges).T
        if corners.shape != (2, 3) or not np.isfinite(corners).all():
            raise ValueError
    except ValueError:
        raise InputError(
            f"--working {text} is no box; write smallest and largest x, y and z in m like 0.4:0.9,-0.3:0.3,0.2:0.8, or name a file."
        ) from None
    return corners
