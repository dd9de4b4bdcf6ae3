"""Rows whose points cannot be where the robot was: by rigid fits to few rows at a time, before any parameter is fitted."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from flexcal.calibration.kinds import best_motion
from flexcal.data.poses import PoseSet

GROSS = 0.030
"""Distance of a point from where a rigid fit has it, m, that no error of a robot explains."""
FEWEST = 5
"""Least number of consistent rows of a station from which rows are judged."""
_EXTENT = 0.02
"""Least extent of the points, m, from which they tell where the instrument stands, or whether they are mirrored."""
_SAMPLES, _OF, _ROUNDS = 150, 4, 3


@dataclass(frozen=True, eq=False)
class ConsistentRows:
    """Largest consistent set of rows of every station: `used` (N,).

    `moved` is the row before which the instrument or the base was moved far: the rows on its two sides are consistent among themselves.
    `mirrored` are the stations whose points fit only after a reflection.
    """

    used: np.ndarray
    moved: int | None = None
    mirrored: frozenset[str] = frozenset()

    @classmethod
    def of(cls, predicted: np.ndarray, rows: PoseSet) -> ConsistentRows:
        """Consistent rows of points `predicted` (N, 3), m, for the robot as described."""
        used, moved, mirrored = np.zeros(len(rows), bool), None, set[str]()
        for station in rows.stations:
            index = np.flatnonzero(rows.station == station)
            expected, measured = predicted[index], rows.position[index]
            own = _largest_consistent(expected, measured)
            if own.sum() < max(FEWEST, 0.8 * len(own)) and _extents(expected)[2] > _EXTENT:
                flipped = _largest_consistent(expected, measured * [1, 1, -1.0])
                if flipped.sum() >= max(FEWEST, 0.8 * len(own)):
                    mirrored.add(station)
            if own.sum() < FEWEST or _extents(expected[own])[1] < _EXTENT:
                continue
            used[index[own]] = True
            since = _moved_since(expected, measured, own)
            moved = moved if since is None else int(index[since])
        return cls(used, moved, frozenset(mirrored))


def length_ratio(predicted: np.ndarray, rows: PoseSet) -> float | None:
    """Median ratio of measured to predicted distances between all points of a station; None for fewer than two apart from each other."""
    ratios: list[float] = []
    for station in rows.stations:
        index = np.flatnonzero(rows.station == station)
        above = np.triu_indices(len(index), 1)
        expected = _distances(predicted[index])[above]
        far = expected > _EXTENT
        ratios += (_distances(rows.position[index])[above][far] / expected[far]).tolist()
    return float(np.median(ratios)) if ratios else None


def _moved_since(expected: np.ndarray, measured: np.ndarray, own: np.ndarray) -> int | None:
    """Row before which the points were moved, where those that are not `own` (N,) are consistent with each other; else None."""
    rest = np.flatnonzero(~own)
    if len(rest) < 3:
        return None
    other = rest[_largest_consistent(expected[rest], measured[rest])]
    if len(other) < 3:
        return None
    mine = np.flatnonzero(own)
    first, second = (mine, other) if mine[0] < other[0] else (other, mine)
    # all of the one before all of the other, a row or so aside
    return int(second[0]) if first[-1] < second[0] else None


def _largest_consistent(expected: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Mask (N,) of the largest set of points that one rigid motion maps to within `GROSS`, over samples of few."""
    count = len(expected)
    best = np.zeros(count, bool)
    if count < 3:
        return best
    for sample in _samples(count):
        inside = sample
        for _ in range(_ROUNDS):
            apart = np.linalg.norm(_moved(expected, measured, inside) - measured, axis=1)
            inside, before = np.flatnonzero(apart < GROSS), inside
            if len(inside) < 3 or np.array_equal(inside, before):
                break
        if len(inside) >= 3 and len(inside) > best.sum():
            best = np.zeros(count, bool)
            best[inside] = True
            if len(inside) == count:
                break
    return best


def _samples(count: int) -> list[np.ndarray]:
    """All rows, then neighbouring ones, then others (at random, always the same)."""
    samples = [np.arange(count)]
    size = min(_OF, count)
    if count <= 8:
        return samples + [np.array(some) for some in combinations(range(count), min(size, max(3, count - 1)))]
    samples += [np.arange(k, k + size) for k in np.unique(np.linspace(0, count - size, 40).astype(int))]
    rng = np.random.default_rng(0)
    return samples + [np.sort(rng.choice(count, size, replace=False)) for _ in range(_SAMPLES)]


def _moved(expected: np.ndarray, measured: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Points `expected` (N, 3), mapped by the rigid motion that fits the `chosen` ones to the measured."""
    rotation, translation = best_motion(expected[chosen], measured[chosen])
    return expected @ rotation.T + translation


def _extents(points: np.ndarray) -> np.ndarray:
    """Root mean square extents (3,), m, of points along their principal axes."""
    if len(points) < 3:
        return np.zeros(3)
    return np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / np.sqrt(len(points))


def _distances(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - points[None], axis=2)
