"""Significance of the differences between two runs: errors and parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexcal.estimation import Estimate

_STRETCHES = 20
"""Number of stretches whose means count as independent, since errors of neighbours in measuring order are correlated."""
LEVEL = 0.05


@dataclass(frozen=True)
class MeanDifference:
    """Mean distance of the second run minus that of the first (m), with its 95 % interval; `paired` by point where both saw the same."""

    value: float
    low: float
    high: float
    paired: bool

    @property
    def significant(self) -> bool:
        """Whether zero is outside the interval."""
        return self.low > 0 or self.high < 0


@dataclass(frozen=True)
class ParameterChange:
    """A parameter in both runs: values and 1σ in natural units, and the difference over the root of the summed variances."""

    name: str
    unit: str
    values: tuple[float, float]
    std: tuple[float, float]
    score: float


@dataclass(frozen=True)
class ParameterChanges:
    """All parameters that both runs determine and mean the same by, the largest change first.

    `others` are determined in both, but the runs dropped different parameters, which they took up. `probability` that chance makes all
    changes together as large, by χ² with the full covariances; nan where there is none to compare.
    """

    changes: tuple[ParameterChange, ...]
    others: tuple[str, ...]
    probability: float

    @property
    def beyond(self) -> tuple[ParameterChange, ...]:
        """Those that changed by more than 95 % of chance changes."""
        from scipy.stats import norm

        bound = float(norm.ppf(1 - LEVEL / 2))
        return tuple(change for change in self.changes if abs(change.score) > bound)


def mean_difference(first: np.ndarray, second: np.ndarray, *, paired: bool) -> MeanDifference:
    """Difference of the mean sizes of error vectors (N, 3) and (M, 3) m in measuring order; Student's t on means of stretches, Welch's
    if not `paired`.

    It speaks of other points measured with the same two robots, not of other robots or calibrations.
    """
    from scipy.stats import t

    sizes = [np.linalg.norm(errors, axis=1) for errors in (first, second)]
    if paired:
        sizes = [sizes[1] - sizes[0]]
        value = float(sizes[0].mean())
    else:
        value = float(sizes[1].mean() - sizes[0].mean())
    means = [np.array([part.mean() for part in np.array_split(x, min(len(x), _STRETCHES))]) for x in sizes]
    if min(len(m) for m in means) < 2:
        return MeanDifference(value, -math.inf, math.inf, paired)
    variances = [float(m.var(ddof=1)) / len(m) for m in means]
    total = sum(variances)
    freedom = (
        total**2 / sum(v**2 / (len(m) - 1) for v, m in zip(variances, means, strict=True)) if total else 1.0
    )
    half = float(t.ppf(1 - LEVEL / 2, freedom)) * math.sqrt(total)
    return MeanDifference(value, value - half, value + half, paired)


def parameter_changes(first: Estimate, second: Estimate) -> ParameterChanges:
    """Changes between two independent estimates: difference over the square root of the summed variances.

    A kept parameter estimates itself and what it absorbed, so it is compared only where both absorbed the same.
    """
    common = [
        name
        for name in first.parameters.names
        if name in second.parameters and all(e.std(name) for e in (first, second))
    ]
    taken = [_absorbed(estimate) for estimate in (first, second)]
    same = [name for name in common if taken[0].get(name, set()) == taken[1].get(name, set())]
    others = tuple(name for name in common if name not in same)
    if not same:
        return ParameterChanges((), others, math.nan)
    (x, xx), (y, yy) = first.marginal(same), second.marginal(same)
    std = np.sqrt(np.diag(xx + yy))
    scores = (y - x) / std
    changes = [
        ParameterChange(
            name,
            first.parameters[name].unit,
            (first.values[name], second.values[name]),
            (first.std(name) or 0.0, second.std(name) or 0.0),
            float(score),
        )
        for name, score in zip(same, scores, strict=True)
    ]
    changes.sort(key=lambda change: -abs(change.score))
    return ParameterChanges(tuple(changes), others, _chance(scores, (xx + yy) / np.outer(std, std)))


def _absorbed(estimate: Estimate) -> Mapping[str, set[str]]:
    """Dropped parameters absorbed by each kept one, by name."""
    absorbed: dict[str, set[str]] = {}
    for dropped in estimate.dropped:
        for kept, coefficient in dropped.absorbed_by:
            if coefficient:
                absorbed.setdefault(kept, set()).add(dropped.name)
    return absorbed


def _chance(scores: np.ndarray, correlation: np.ndarray) -> float:
    from scipy.stats import chi2

    statistic = float(scores @ np.linalg.lstsq(correlation, scores, rcond=1e-12)[0])
    return float(chi2.sf(statistic, np.linalg.matrix_rank(correlation, tol=1e-10)))
