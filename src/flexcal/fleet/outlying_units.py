"""Units that differ from the others by more than those differ among themselves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flexcal.fleet.between_units import variance_at, weighted_mean

_FEWEST = 5
"""Least number of units among which an outlying one is looked for."""
_LARGEST_SHARE = 0.2
"""Largest share of units that may be outlying; with more there is no majority of one kind."""

_MANY = 25
"""Least number of units at which the error rate holds although tests go on after one that is not significant (Rosner 1983)."""


@dataclass(frozen=True)
class Outlying:
    """An outlying unit: its number, its deviation from the others over the standard deviation of that, and the p-value, corrected for
    the number of units and of quantities.
    """

    number: int
    score: float
    probability: float


def outlying(values: np.ndarray, std: np.ndarray, quantities: int, level: float) -> tuple[Outlying, ...]:
    """Outlying units among N with values (N,) and standard deviations (N,) of measurement, the most outlying first.

    The most extreme unit is taken out one by one, up to a fifth of them, and compared with those that remain by Student's t with their
    variance; all up to the last significant one are outlying, so that several do not hide each other (generalised extreme studentised
    deviate, Rosner 1983, Technometrics 25, with variances of measurement beside the variance between units). With fewer than 25 units
    this ends at the first that is not significant. Among fewer than five none is looked for. `level` is the probability that any is named
    where there is none, over all `quantities` that are tested like this one.
    """
    from scipy.special import stdtr

    if len(values) < _FEWEST:
        return ()
    left = np.arange(len(values))
    candidates: list[Outlying] = []
    last = 0
    for _ in range(max(1, int(_LARGEST_SHARE * len(values)))):
        between = variance_at(values[left], std[left], len(left) - 1.0)
        mean, _ = weighted_mean(values[left], std[left], between)
        size = np.sqrt(std[left] ** 2 + between)
        if not size.min() > 0:
            break
        most = int(np.argmax(np.abs(values[left] - mean) / size))
        number, others = int(left[most]), np.delete(left, most)
        score, freedom = _deviation(values, std, number, others)
        probability = 2 * float(stdtr(freedom, -abs(score))) * len(left) * quantities
        candidates.append(Outlying(number, score, min(probability, 1.0)))
        if probability <= level:
            last = len(candidates)
        elif len(values) < _MANY:
            break
        left = others
    return tuple(candidates[:last])


def _deviation(values: np.ndarray, std: np.ndarray, number: int, others: np.ndarray) -> tuple[float, float]:
    """Deviation of a unit from the others over its standard deviation, and the degrees of freedom of that, after Satterthwaite: the
    variance between units is the less certain the larger the variances of measurement of the others are.
    """
    between = variance_at(values[others], std[others], len(others) - 1.0)
    mean, mean_variance = weighted_mean(values[others], std[others], between)
    own = between + std[number] ** 2
    weights = 1.0 / (std[others] ** 2 + between)
    freedom = (own * float(weights.sum()) / len(others)) ** 2 * (len(others) - 1)
    return float(values[number] - mean) / math.sqrt(own + mean_variance), freedom
