"""Errors in the data of a visit: axes swapped, points of other poses, several poses that disagree with the rest."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.measurement import predict_measurements
from flexcal.calibration.recheck import (
    ALIKE,
    FALSE_ALARM,
    GlobalTest,
    JudgedVisit,
    misfit_of,
    single_deviation,
)
from flexcal.data.poses import PoseSet
from flexcal.jobs.inputs import misread_point, planned_pose
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

_MOST = 0.75
"""Share of the poses that one explanation must fit to be that of the file."""
_LEAST = 6
"""Least number of poses that judge the others."""
_REST = 0.1
"""Probability of what is left below which not single poses, but all of them scatter more than they should."""


@dataclass(frozen=True, eq=False)
class DataErrors:
    """What is wrong with the data of a visit, in `words`, and the judgement by the `rest` of the poses, None where too few are left."""

    words: str
    rest: JudgedVisit | None


def misread_visit(
    model: RobotModel, poses: PoseSet, noise: float, judge: Callable[[PoseSet], JudgedVisit | None]
) -> DataErrors | None:
    """Axes, units or rows that were exchanged, where that makes the points those of the calibrated robot to about `noise`, m; None where
    nothing certain was.
    """
    expected = predict_measurements(model, poses).position
    tolerance = 2 * noise + 0.5 * MILLIMETRE
    pairs = list(zip(poses.position, expected, strict=True))
    axes = Counter(
        found.words for measured, at in pairs if (found := misread_point(measured, at, tolerance)) is not None
    )
    if axes and axes.most_common(1)[0][1] >= _MOST * len(poses):
        off = np.sqrt(np.mean(np.sum((poses.position - expected) ** 2, axis=1)))
        return DataErrors(
            f"the points are {off / MILLIMETRE:.0f} mm off (rms) as {axes.most_common(1)[0][0]}: mend the file",
            None,
        )
    belongs = []
    for k, (measured, at) in enumerate(pairs):
        others = (poses.target == poses.target[k]) & (poses.pose != poses.pose[k])
        other = planned_pose(measured, at, expected[others], poses.pose[others], tolerance)
        if other is not None:
            belongs.append((k, f"the point of pose {poses.pose[k]} is that of pose {other.pose}"))
    if not belongs:
        return None
    wrong = np.isin(poses.pose, poses.pose[[k for k, _ in belongs]])
    return DataErrors(
        f"{', '.join(words for _, words in belongs)}: mend the rows",
        judge(poses.subset(~wrong)) if (~wrong).sum() >= _LEAST else None,
    )


def disagreeing_poses(
    judged: JudgedVisit, poses: PoseSet, judge: Callable[[PoseSet], JudgedVisit | None]
) -> DataErrors | None:
    """The fewest poses, at most a quarter of them, without which the visit is as calibrated or shows one change; None for none.

    None are blamed where two changes of the robot explain all errors, or one link that bent or grew, unless these are less likely by odds
    of 20 (Schwarz's criterion).
    """
    test = judged.test
    changes = [np.zeros((test.size, 0)), *(item.basis for item in test.seen)]
    found = [left for basis in changes if (left := _left_out(test, basis)) is not None]
    rivals = [(single_deviation(test), 1)]
    if judged.rivals is not None:
        rivals.append((judged.rivals.misfit, judged.rivals.rank))
    limit = min(_score(test, misfit, rank) for misfit, rank in rivals) - ALIKE
    found = [left for left in found if _score(test, left.misfit, left.rank) < limit]
    for left in sorted(found, key=lambda left: (len(left.poses), -left.chance)):
        wrong = left.poses
        numbers = test.errors.poses.pose[list(wrong)]
        rest = judge(poses.subset(~np.isin(poses.pose, numbers)))
        if rest is None or not (rest.as_calibrated or rest.suspects):
            continue
        if judged.scatter is not None and rest.together < _REST:
            continue
        off = np.linalg.norm(test.errors.errors.reshape(-1, 3)[list(wrong)], axis=1) / MILLIMETRE
        told = " and ".join(f"pose {n} ({d:.3f} mm off)" for n, d in zip(numbers, off, strict=True))
        return DataErrors(
            f"{told} disagree{'s' if len(wrong) == 1 else ''} with the others: measure again", rest
        )
    return None


@dataclass(frozen=True)
class _LeftOut:
    """Indices of `poses` that are left out, and what the others and a change leave: the sum of squares, whitened, by `rank` numbers, and
    the probability that chance leaves as much.
    """

    poses: tuple[int, ...]
    misfit: float
    rank: int
    chance: float


def _score(test: GlobalTest, misfit: float, rank: int) -> float:
    """Twice the negative log-likelihood with what Schwarz's criterion adds for the parameters."""
    freedom = test.freedom
    cost = misfit if not np.isfinite(freedom) else (freedom + test.size) * float(np.log1p(misfit / freedom))
    return cost + rank * float(np.log(test.size))


def _left_out(test: GlobalTest, basis: np.ndarray) -> _LeftOut | None:
    """Poses left out one by one, each time that which explains most beside a change with this `basis` (m, r), until chance leaves the
    rest.
    """
    values = test.whitening @ test.errors.errors
    count = len(test.errors.poses)
    blocks = [test.whitening[:, 3 * k : 3 * k + 3] for k in range(count)]
    wrong: list[int] = []
    while len(wrong) < min(count // 4, count - _LEAST):
        left = [misfit_of(values, np.hstack([basis, block])) for block in blocks]
        best = int(np.argmin([misfit if k not in wrong else np.inf for k, (misfit, _) in enumerate(left)]))
        wrong.append(best)
        misfit, rank = left[best]
        basis = np.hstack([basis, blocks[best]])
        if test.size > rank and (chance := float(test.chance(misfit, test.size - rank))) > FALSE_ALARM:
            return _LeftOut(tuple(wrong), misfit, rank, chance)
    return None
