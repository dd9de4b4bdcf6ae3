"""Predicted accuracy of the calibrated robot over the working volume."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.measurement import Propagation
from flexcal.errors import FlexcalError
from flexcal.estimation import distance_quantile, mean_distance, principal_variances
from flexcal.model.kinematics import joint_ranges, point_kinematics, random_configurations
from flexcal.progress import Progress, silent

_BATCH = 256
"""Poses processed together: their derivatives stay in the processor's cache and in reused memory."""
_FEW = 2
"""Number of batches up to which they are processed one after the other."""
_DRAWN = 100_000
_FEWEST = 1e-4
"""Share of all random poses below which a box counts as out of reach."""


@dataclass(frozen=True, eq=False)
class PredictedAccuracy:
    """Predicted error at each pose `q` (N, n), rad or m: `position` (N, 3) of the point, base frame, `mean` and 95 % quantile `p95` (N,)
    of its error, m.

    The error is the distance between where the calibrated model has the point and where an instrument at the station finds it, from the
    uncertainty of the parameters alone.
    """

    q: np.ndarray
    position: np.ndarray
    mean: np.ndarray
    p95: np.ndarray

    def scaled(self, factor: float) -> PredictedAccuracy:
        """Prediction with every error multiplied by `factor`."""
        return PredictedAccuracy(self.q, self.position, factor * self.mean, factor * self.p95)

    def part(self, rows: np.ndarray) -> PredictedAccuracy:
        """Poses with these indices, in their order."""
        return PredictedAccuracy(self.q[rows], self.position[rows], self.mean[rows], self.p95[rows])

    @classmethod
    def joined(cls, parts: Sequence[PredictedAccuracy]) -> PredictedAccuracy:
        """Poses of all parts, one after the other."""
        return cls(
            *(
                np.concatenate(rows)
                for rows in zip(*((p.q, p.position, p.mean, p.p95) for p in parts), strict=True)
            )
        )


def predicted_accuracy(
    reach: Propagation, q: np.ndarray, *, threads: int | None = None, progress: Progress = silent
) -> PredictedAccuracy:
    """Mean and 95 % quantile of the tool's error at poses `q` (N, n), to first order in the parameters; `threads` None takes all cores."""
    result = PredictedAccuracy(q, np.empty((len(q), 3)), np.empty(len(q)), np.empty(len(q)))

    def fill(rows: slice) -> None:
        result.position[rows], roots = reach.roots(q[rows])
        variances = principal_variances(roots @ np.swapaxes(roots, 1, 2))
        result.mean[rows], result.p95[rows] = mean_distance(variances), distance_quantile(variances)

    _in_batches(fill, len(q), threads, progress)
    return result


def predicted_rms(reach: Propagation, q: np.ndarray) -> np.ndarray:
    """Root mean square (N,), m, of the tool's error at poses `q` (N, n), to first order in the parameters."""
    result = np.empty(len(q))

    def fill(rows: slice) -> None:
        result[rows] = np.sqrt(np.sum(reach.roots(q[rows])[1] ** 2, axis=(1, 2)))

    _in_batches(fill, len(q))
    return result


def _in_batches(
    fill: Callable[[slice], None], count: int, threads: int | None = None, progress: Progress = silent
) -> None:
    """Call `fill` with the rows of every batch of `count` poses, in `threads`; None takes all cores."""
    starts = range(0, count, _BATCH)
    if len(starts) <= _FEW:
        # threads would take longer to start
        for start in starts:
            fill(slice(start, start + _BATCH))
        progress("accuracy map", 1.0)
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        batches = pool.map(lambda start: fill(slice(start, start + _BATCH)), starts)
        for number, _ in enumerate(batches, start=1):
            progress("accuracy map", number / len(starts))


def random_poses_in(
    reach: Propagation,
    count: int,
    rng: np.random.Generator,
    box: np.ndarray | None = None,
    progress: Progress = silent,
) -> np.ndarray:
    """`count` poses (count, n), uniform over the joint ranges, that put the target into a `box` (2, 3), m, base frame; None: anywhere.

    Neither collisions nor the floor are looked at. Raises `FlexcalError` for a box that is hardly or not at all in reach.
    """
    model = reach.model
    lower, upper = joint_ranges(model)
    if box is None:
        return random_configurations(model, count, rng, lower, upper)
    if not np.all(box[0] < box[1]):
        raise FlexcalError(
            "E-CAL-003",
            f"the working volume from {_told(box[0])} to {_told(box[1])} is no box; give every smallest coordinate before the largest.",
        )
    accepted: list[np.ndarray] = []
    have = drawn = 0
    for q in _draws(rng, lower, upper):
        at = point_kinematics(model, q, point=reach.target, jacobians=False).position
        inside = q[np.all((at >= box[0]) & (at <= box[1]), axis=1)]
        accepted.append(inside)
        have, drawn = have + len(inside), drawn + len(q)
        progress("poses", min(have / count, 1.0))
        if have >= count:
            break
        if have < _FEWEST * drawn and drawn >= 10 * _DRAWN:
            raise FlexcalError(
                "E-CAL-004",
                f"of {drawn} random poses of {model.name} {have} reach the working volume from {_told(box[0])} to {_told(box[1])} m (it "
                f"reaches {model.reach:.3g} m); give a larger box in the robot's base frame, or a file of the poses to look at.",
            )
    return np.concatenate(accepted)[:count]


def _draws(rng: np.random.Generator, lower: np.ndarray, upper: np.ndarray) -> Iterator[np.ndarray]:
    while True:
        yield rng.uniform(lower, upper, (_DRAWN, len(lower)))


def _told(position: np.ndarray) -> str:
    return ", ".join(f"{value:g}" for value in position)
