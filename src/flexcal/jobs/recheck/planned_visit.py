"""Plan of the poses of rechecks: those that find shifts of single joints best, with the predicted power."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.recheck import (
    Compared,
    DetectionLimit,
    GlobalTest,
    detection_limits,
    planned_errors,
    possible_changes,
)
from flexcal.data.plans import PosePlan, write_plan
from flexcal.data.poses import PoseSet
from flexcal.design.poses import measurement_order, measuring_noise, random_candidates
from flexcal.design.scene import CollisionChecker, MeasuringSetup
from flexcal.errors import FlexcalError
from flexcal.jobs.inputs import CalibratedRobot, robot_provenance
from flexcal.jobs.recheck.document import SHIFT, power_block
from flexcal.jobs.recheck.longer_tool import ROUNDS, LongerTools, all_points, found_in_words, longer_tools
from flexcal.jobs.recheck.pose_choice import PoseInformation, best_poses
from flexcal.jobs.result_files import RunRecord
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

PLAN = "plan.yaml"
_CANDIDATES = 400


@dataclass(frozen=True, eq=False)
class PlannedVisit:
    """Plan of N poses, and by design of the recheck what it finds.

    Attributes
    ----------
    plan : PosePlan
        The poses in an order of short moves.
    limits : mapping of tuple of DetectionLimit
        Shifts of single joints that are found, by what the visit is compared with: "calibration", "reference" (each pose read once) and
        "reference_repeated" (each read three times), and the same with "_refit" where the instrument was moved in between.
    points : tuple of str
        Points that are read at every pose.
    longer : LongerTools or None
        What a longer tool would find, where these points do not find 0.05 mrad of every joint.
    file : Path
        File of the plan.
    record : RunRecord
        What it comes from.
    """

    plan: PosePlan
    limits: Mapping[str, tuple[DetectionLimit, ...]]
    points: tuple[str, ...]
    longer: LongerTools | None
    file: Path
    record: RunRecord

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "plan": self.file,
            "poses": len(self.plan),
            "seed": self.plan.seed,
            "power": {name: power_block(limits) for name, limits in self.limits.items()},
            "points": list(self.points),
            "longer_tools": None if self.longer is None else self.longer.document(),
            **self.record.document(),
        }

    @property
    def lines(self) -> tuple[str, ...]:
        """Predicted shifts that are found, by design, as text."""
        words = {
            "reference_repeated": f"against a reference visit that reads every pose {ROUNDS} times",
            "reference": "against a reference visit that reads every pose once",
            "calibration": "against the calibration alone",
        }
        told = []
        for name, word in words.items():
            told.append(f"{word}: {found_in_words(self.limits[name])}")
        told.append(
            f"the first of these, with the instrument set up anew: {found_in_words(self.limits['reference_repeated_refit'])}"
        )
        if self.longer is not None:
            told += self.longer.lines
        return tuple(told)


def plan_visit(
    robot_file: Path,
    out: Path,
    count: int,
    *,
    estimates: Path | None = None,
    refit: bool = False,
    seed: int = 0,
    command: str = "",
    progress: Progress = silent,
) -> PlannedVisit:
    """Choose `count` poses that find the least shifts of single joints, and write plan.yaml to the folder `out`.

    With `refit` they are chosen for an instrument that is set up anew for every visit. Raises `FlexcalError` as reading does, for fewer
    than four poses, and where too few poses are free and visible.
    """
    if count < 4:
        raise FlexcalError("E-RECHECK-008", f"{count} poses tell too little; plan four or more, better ten.")
    robot = CalibratedRobot.from_yaml(robot_file, estimates)
    model = robot.model
    checker, setup = CollisionChecker(model), MeasuringSetup.declared(model, None)
    progress("candidates", 0.0)
    candidates = _candidates(robot, checker, setup, max(_CANDIDATES, 4 * count), seed)
    each = [replace(candidates, target=np.full(len(candidates), name)) for name in robot.measured]
    progress("candidates", 0.4)
    chosen = best_poses(PoseInformation.of(model, each), count, refit=refit)
    order = measurement_order(checker, candidates.q[chosen]).order
    poses = all_points([rows.subset(chosen[order]) for rows in each])
    plan = PosePlan(q=candidates.q[chosen[order]], seed=seed, name="recheck")
    progress("candidates", 0.7)
    limits = {}
    designs: tuple[tuple[str, Compared, int], ...] = (
        ("calibration", "calibration", 1),
        ("reference", "reference", 1),
        ("reference_repeated", "reference", ROUNDS),
    )
    for name, compared, rounds in designs:
        for suffix, placed in (("", False), ("_refit", True)):
            errors = planned_errors(model, poses, compared=compared, placed=placed, rounds=rounds)
            test = GlobalTest.of(errors, possible_changes(model, errors.at))
            limits[name + suffix] = detection_limits(test, SHIFT)
    design = limits["reference_repeated_refit" if refit else "reference_repeated"]
    longer = longer_tools(model, candidates, design, count, refit=refit)
    progress("candidates", 1.0)
    write_plan(out / PLAN, plan)
    record = RunRecord(robot_provenance(robot.nominal, []), command)
    return PlannedVisit(plan, limits, robot.measured, longer, out / PLAN, record)


def _candidates(
    robot: CalibratedRobot, checker: CollisionChecker, setup: MeasuringSetup, count: int, seed: int
) -> PoseSet:
    """Poses within the joint ranges of the calibration, of its first point, whose readings are still zero."""
    model = robot.model
    ranges = robot.blocks["calibration"].ranges
    rng = np.random.default_rng([seed, 8])
    drawn = random_candidates(checker, 4 * count, rng, setup, preload=True)
    inside = np.ones(len(drawn), bool)
    for k, name in enumerate(model.motor_names):
        if name in ranges:
            inside &= (drawn[:, k] >= ranges[name][0]) & (drawn[:, k] <= ranges[name][1])
    # where the calibration covered a small part, joints are drawn there
    q = drawn[inside] if inside.sum() >= count else _within(model, drawn, ranges, checker)
    q = q[:count]
    stated = model.value("scatter.instrument_share") > 0 or not model.scatter.std.any()
    sigma = measuring_noise(model, q, setup) if stated else np.full(len(q), 1e-4)
    return replace(
        PoseSet.unmeasured(q, robot.measured[0], model.stations.names[0], sigma), sigma_given=stated
    )


def _within(
    model: RobotModel,
    drawn: np.ndarray,
    ranges: Mapping[str, tuple[float, float]],
    checker: CollisionChecker,
) -> np.ndarray:
    """Configurations moved linearly into the ranges, those free of collision."""
    q = drawn.copy()
    for k, name in enumerate(model.motor_names):
        if name in ranges:
            low, high = ranges[name]
            share = (q[:, k] - q[:, k].min()) / max(float(np.ptp(q[:, k])), 1e-12)
            q[:, k] = low + share * (high - low)
    return q[~checker.collides(q)]
