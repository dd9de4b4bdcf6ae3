"""Probabilities of sums of squares of units of which one combination may scatter by more than its covariance tells, in some units only."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

_AS_TOLD = 0.25
"""Probability, beforehand, that no unit scatters by more than its covariance tells."""
_SHARES = (0.0, 0.3, 0.6, 0.85)
"""Shares of units that scatter as their covariances tell, in populations of which the others do not."""
_WIDTHS = (0.0, 0.7, 1.4, 2.1)
"""Standard deviations, between those others, of the logarithm of the excess of the variance of one combination."""
_EXCESSES = np.geomspace(0.3, 1e5, 32)
_MEDIANS = np.geomspace(0.3, 1e5, 14)
_CAUTION = 0.94
"""Probability that a population gives a p-value no larger than the one that counts."""
_NODES = 80
_FAR = 20.0
"""Standard deviations of a χ²-variate beyond which nothing is left."""
_TINY = 1e-300


def excess_tails(
    statistics: np.ndarray, residuals: np.ndarray, visits: np.ndarray, quantities: np.ndarray
) -> np.ndarray:
    """Probabilities (n,) that the sum of `quantities` (n,) squares of a unit is above its statistic (n,), where that of as many of each of
    its `visits` (n,) is its residual (n,).

    All have variance 1, but for one combination that has 1 + e, e ≥ 0, which differs from unit to unit. The residuals of all units tell
    which populations of e they may be of, and a unit's own, beside its population, which e it has. The p-value is the posterior predictive
    one (Gelman, Meng and Stern 1996, Statistica Sinica 6) at a population that is as unfavourable to each unit as the residuals allow with
    a probability of 94 %: the mean over populations would be too small just where few units scatter most.
    """
    variances = 1.0 + np.r_[0.0, _EXCESSES]
    tails = np.array([_tails(s, variances, m) for s, m in zip(statistics, quantities, strict=True)])
    logs = np.array(
        [_log_densities(r, variances, k, m) for r, k, m in zip(residuals, visits, quantities, strict=True)]
    )
    likelihood = np.maximum(np.exp(logs - logs.max(axis=1, keepdims=True)), _TINY)
    populations, before = _populations()
    evidence = populations @ likelihood.T
    weights = np.log(evidence).sum(axis=1) + np.log(before)
    weights = np.exp(weights - weights.max())
    each = (populations @ (likelihood * tails).T) / evidence
    order = np.argsort(each, axis=0)
    reached = np.cumsum(weights[order], axis=0) >= _CAUTION * weights.sum()
    chosen = order[np.argmax(reached, axis=0), np.arange(each.shape[1])]
    return np.minimum(1.0, each[chosen, np.arange(each.shape[1])])


@cache
def _populations() -> tuple[np.ndarray, np.ndarray]:
    """Probabilities (h, e) of no excess and of each of `_EXCESSES` in populations of units, and of the populations (h,) beforehand."""
    logs = np.log(_EXCESSES)
    narrowest = (logs[1] - logs[0]) / 2
    rows = [np.eye(len(logs) + 1)[0]]
    for width in _WIDTHS:
        for middle in np.log(_MEDIANS):
            bell = np.exp(-(((logs - middle) / max(width, narrowest)) ** 2) / 2)
            rows += [np.r_[share, (1 - share) * bell / bell.sum()] for share in _SHARES]
    others = len(rows) - 1
    return np.array(rows), np.r_[_AS_TOLD, np.full(others, (1 - _AS_TOLD) / others)]


@cache
def _rule() -> tuple[np.ndarray, np.ndarray]:
    """Squared nodes and steps on [0, 1] of an integral whose integrand may be infinite at 0 as the density of χ² with one degree is."""
    nodes, steps = np.polynomial.legendre.leggauss(_NODES)
    root = (nodes + 1) / 2
    return root**2, root * steps


def _tails(statistic: float, variances: np.ndarray, quantities: int) -> np.ndarray:
    """Probabilities that λ χ² + χ² with 1 and `quantities` − 1 degrees of freedom are above the statistic, λ of the `variances`."""
    from scipy.special import chdtrc

    others = quantities - 1
    if not others:
        return chdtrc(1, statistic / variances)
    square, step = _rule()
    end = max(_TINY, min(statistic, others + _FAR * math.sqrt(2 * others) + _FAR))
    x = end * square
    inside = chdtrc(1, np.maximum(statistic - x, 0.0) / variances[:, None])
    return inside @ (end * step * np.exp(_log_density(x, others))) + chdtrc(others, end)


def _log_densities(residual: float, variances: np.ndarray, visits: int, quantities: int) -> np.ndarray:
    """Logarithms of the densities of λ χ² + χ² with `visits` and `visits` (`quantities` − 1) degrees of freedom at the residual."""
    residual = max(residual, _TINY)
    if quantities == 1:
        return _log_density(residual / variances, visits) - np.log(variances)
    square, step = _rule()
    u = residual * square
    rest = _log_density(residual - u, (quantities - 1) * visits)
    logs = _log_density(u / variances[:, None], visits) + rest
    largest = logs.max(axis=1)
    return np.log(np.exp(logs - largest[:, None]) @ step * residual) + largest - np.log(variances)


def _log_density(x: np.ndarray, freedom: float) -> np.ndarray:
    """Logarithm of the density of the χ²-distribution."""
    half = freedom / 2
    return (half - 1) * np.log(x) - x / 2 - half * math.log(2) - math.lgamma(half)
