"""Two groups of units that differ in many quantities together, as those of two production batches."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

_FEWEST = 6
"""Least number of units among which groups are looked for."""
_LEAST = 3
"""Least number of units of a group: one or two are outlying units, and no groups."""
_RATIO = 0.2
"""Largest variance within groups over the whole one, along the line between them: that of groups of equal size 4 standard deviations apart;
a uniform distribution cut into halves has 0.25.
"""
_DRAWS = 4000
_FOLDS = 60
"""Largest number of parts of which each is placed by a line from the others."""
_STEPS = 10


@dataclass(frozen=True, eq=False)
class TwoGroups:
    """Two groups of N units: `second` (N,) says which are of the second, the smaller; `separation` is the distance of their means over the
    standard deviation within them, along the line between them or in one quantity, and `probability` the p-value of their being one group.
    """

    second: np.ndarray
    separation: float
    probability: float


def two_groups(values: np.ndarray) -> TwoGroups | None:
    """The two groups that units with standardised `values` (N, p) most probably are of; None among fewer than six units.

    Each unit is placed along the line between the means of two groups of the *others*, found by their first principal component and
    Lloyd's algorithm (1982), so that its place is none of what made the line: with many quantities and few units some line parts any
    units well. Whatever the covariance of the quantities, the places of units of one normal population are normal then. The statistic is
    the variance within two groups of three units or more over the whole variance, the least of all cuts of the line (Fisher 1958; of two
    equal normal groups 1/(1 + D²/4), with Ashman's D). Its p-value is the largest of those under a normal, a Student distribution with 4
    degrees of freedom and a uniform one, of as many units. Groups that differ in a single quantity are no line among many: the quantity
    with the least such ratio is tested too, and the p-values are corrected for both tests and for the number of quantities.
    """
    count = len(values)
    if count < _FEWEST:
        return None
    whole = _halves(values)
    place = np.empty(count)
    folds = np.arange(count) % min(count, _FOLDS)
    for fold in range(folds.max() + 1):
        own, others = folds == fold, folds != fold
        known = _halves(values[others])
        if np.mean(known == whole[others]) < 0.5:
            known = ~known
        first, second = values[others][~known].mean(axis=0), values[others][known].mean(axis=0)
        line = second - first
        length = float(np.linalg.norm(line))
        place[own] = (values[own] - (first + second) / 2) @ line / (length or 1.0)
    single = int(np.argmin(least_within(values.T)[0]))
    together, alone = _cut(place, 2), _cut(values[:, single], 2 * values.shape[1])
    return min(together, alone, key=lambda groups: groups.probability)


def _cut(places: np.ndarray, tests: int) -> TwoGroups:
    """Groups of units at `places` (N,) on a line, one of so many `tests`."""
    count = len(places)
    ratio, size = least_within(places)
    second = np.zeros(count, dtype=bool)
    second[np.argsort(places)[int(size) :]] = True
    if second.sum() > count / 2:
        second = ~second
    within = max(float(ratio), np.finfo(float).tiny)
    share = float(second.mean())
    separation = float(np.sqrt((1 / within - 1) / (share * (1 - share))))
    probability = 1.0 if ratio > _RATIO else max(float(np.mean(one <= ratio)) for one in _of_one_group(count))
    return TwoGroups(second, separation, min(tests * max(probability, 1 / _DRAWS), 1.0))


def least_within(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least variance within two groups of `places` (…, N) on a line over the whole variance (…), and the size of the lower group."""
    ordered = np.sort(places, axis=-1)
    ordered = ordered - ordered.mean(axis=-1, keepdims=True)
    count = ordered.shape[-1]
    sizes = np.arange(_LEAST, count - _LEAST + 1)
    sums = np.cumsum(ordered, axis=-1)[..., sizes - 1]
    between = sums**2 * count / (sizes * (count - sizes))
    total = np.sum(ordered**2, axis=-1)
    best = between.max(axis=-1)
    ratio = 1 - np.divide(best, total, out=np.zeros_like(best), where=total > 0)
    return ratio, sizes[between.argmax(axis=-1)]


@cache
def _of_one_group(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ratios (draws,) of `least_within` of units of one group, of three distributions."""
    rng, shape = np.random.default_rng(0), (_DRAWS, count)
    drawn = (rng.standard_normal(shape), rng.standard_t(4, shape), rng.uniform(-1.0, 1.0, shape))
    normal, student, uniform = (least_within(places)[0] for places in drawn)
    return normal, student, uniform


def _halves(values: np.ndarray) -> np.ndarray:
    """Mask (N,) of the second of two groups: a cut of the first principal component, then Lloyd's algorithm."""
    centred = values - values.mean(axis=0)
    component = np.linalg.eigh(centred @ centred.T)[1][:, -1]
    least = min(_LEAST, (len(values) - 1) // 2)
    second = np.zeros(len(values), dtype=bool)
    second[
        np.argsort(component)[int(least_within(component)[1]) if len(values) >= 2 * _LEAST else least :]
    ] = True
    for _ in range(_STEPS):
        ends = values[~second].mean(axis=0), values[second].mean(axis=0)
        nearer = (values - (ends[0] + ends[1]) / 2) @ (ends[1] - ends[0]) > 0
        if min(nearer.sum(), (~nearer).sum()) < least or np.array_equal(nearer, second):
            break
        second = nearer
    return second
