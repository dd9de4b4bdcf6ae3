"""Drift of pose accuracy and repeatability (ISO 9283) over repeated visits to the same poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.accuracy.pose_repeatability import PoseRepeatability, repeatability_of
from flexcal.data.poses import PoseSet

VISITS_PER_SET = 10
"""Number of successive visits to a pose that give its accuracy and repeatability at a time."""
_CHANCE = 0.0027
"""Significance level of a drift: three standard deviations of a Gaussian."""


@dataclass(frozen=True, eq=False)
class PoseDrift:
    """One commanded pose over time: its visits in S `sets` of rows, the mean `time` (S,) s of each, its RP, `repeatability` (S,) m.

    `way` (S, 3) m is where the barycentre of each set lies from that of the first; `chance` how often a pose that stays shows so long a
    way from the first set to the last, by Hotelling's T² of two samples.
    """

    sets: tuple[np.ndarray, ...]
    time: np.ndarray
    repeatability: np.ndarray
    way: np.ndarray
    chance: float

    @property
    def certain(self) -> bool:
        """Whether the displacement is statistically significant."""
        return self.chance < _CHANCE

    @property
    def distance(self) -> float:
        """Distance from the barycentre of the first set to that of the last, m."""
        return float(np.linalg.norm(self.way[-1]))

    @property
    def repeatability_drift(self) -> float:
        """Drift dRP, m: change of RP from the first set to the last."""
        return float(abs(self.repeatability[-1] - self.repeatability[0]))

    def accuracy(self, errors: np.ndarray) -> np.ndarray:
        """AP (S,), m, of every set, from `errors` (N, 3) of all rows, measured minus commanded."""
        return np.array([np.linalg.norm(errors[rows].mean(axis=0)) for rows in self.sets])

    def accuracy_drift(self, errors: np.ndarray) -> float:
        """Drift dAP, m: change of AP from the first set to the last."""
        accuracy = self.accuracy(errors)
        return float(abs(accuracy[-1] - accuracy[0]))


def pose_drifts(poses: PoseSet, visited: Sequence[PoseRepeatability]) -> list[PoseDrift]:
    """Drift of every pose that was visited at least twice `VISITS_PER_SET` times; none without times that increase from row to row."""
    time = poses.time
    if time is None or (np.diff(time) < 0).any():
        return []
    return [
        _evaluate(poses.position, time, pose.rows) for pose in visited if len(pose.rows) >= 2 * VISITS_PER_SET
    ]


def common_displacement(drifts: Sequence[PoseDrift]) -> tuple[float, float]:
    """Displacement common to all poses from their first to their last sets, and the root mean square of the remainders, m."""
    ways = np.array([drift.way[-1] for drift in drifts])
    together = ways.mean(axis=0)
    return float(np.linalg.norm(together)), float(np.sqrt(((ways - together) ** 2).sum(axis=1).mean()))


def _evaluate(position: np.ndarray, time: np.ndarray, rows: np.ndarray) -> PoseDrift:
    sets = tuple(np.array_split(rows, len(rows) // VISITS_PER_SET))
    centres = np.array([position[own].mean(axis=0) for own in sets])
    return PoseDrift(
        sets,
        np.array([time[own].mean() for own in sets]),
        np.array([repeatability_of(position[own]) for own in sets]),
        centres - centres[0],
        _chance(position[sets[0]], position[sets[-1]]),
    )


def _chance(first: np.ndarray, last: np.ndarray) -> float:
    """Probability of means so far apart of two samples (n, 3) and (m, 3) of one Gaussian; 0 or 1 where nothing scatters."""
    from scipy.stats import f

    n, m = len(first), len(last)
    freedom, size = n + m - 2, first.shape[1]
    scatter = sum((x - x.mean(axis=0)).T @ (x - x.mean(axis=0)) for x in (first, last)) / freedom
    apart = last.mean(axis=0) - first.mean(axis=0)
    try:
        squared = n * m / (n + m) * apart @ np.linalg.solve(scatter, apart)
    except np.linalg.LinAlgError:
        return float(not apart.any())
    return float(f.sf(squared * (freedom - size + 1) / (freedom * size), size, freedom - size + 1))
