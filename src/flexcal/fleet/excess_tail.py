"""Probability of a sum of squares of which one combination may scatter by more than its covariance tells."""

from __future__ import annotations

import math

import numpy as np

_AS_TOLD = 0.25
"""Probability, beforehand, that nothing scatters by more than its covariance tells."""
_EXCESSES = np.geomspace(0.3, 1e3, 26)
"""Excesses of the variance of one combination, each as probable beforehand as the others."""
_FEWEST = 4
"""Least number of visits beyond lines whose scatter bounds that of one combination, although it may be in any direction."""
_NODES = 80
_FAR = 20.0
"""Standard deviations of a χ²-variate beyond which nothing is left."""


def excess_tail(statistic: float, residual: float, visits: int, quantities: int) -> float:
    """Probability that the sum of `quantities` squares is above a `statistic`, where the sum of those of as many `visits` is `residual`.

    All have variance 1, but for one combination that has λ ≥ 1. With four visits or more the probability is the mean over λ by what the
    residuals tell of it (posterior predictive p-value; Gelman, Meng and Stern 1996, Statistica Sinica 6), with fewer that of λ F + χ² with
    1 and `visits` degrees of freedom, and of one less than the quantities, at a λ one standard deviation above what they show.
    """
    from scipy.special import chdtrc, fdtrc

    others = quantities - 1
    nodes, steps = np.polynomial.legendre.leggauss(_NODES)
    end = min(statistic, others + _FAR * math.sqrt(2 * others) + _FAR)
    x = end * (nodes + 1) / 2
    density = end / 2 * steps * np.exp(_log_density(x, others)) if others else np.zeros(_NODES)
    if visits < _FEWEST:
        largest = 1.0 + max(residual / visits - quantities, 0.0) + math.sqrt(2 * others / visits)
        if not others:
            return float(fdtrc(1, visits, statistic / largest))
        inside = float(density @ fdtrc(1, visits, (statistic - x) / largest))
        return min(1.0, inside + float(chdtrc(others, end)))
    variances = np.r_[1.0, 1.0 + _EXCESSES]
    tails = chdtrc(1, statistic / variances)
    if others:
        tails = chdtrc(1, (statistic - x) / variances[:, None]) @ density + chdtrc(others, end)
    return float(min(1.0, _weights(variances, residual, visits, others) @ tails))


def _weights(variances: np.ndarray, residual: float, visits: int, others: int) -> np.ndarray:
    """Probabilities of the variances of one combination after a sum of squares of `visits`, and as many of each of the `others`."""
    if others:
        # u = residual t², the share of the combination: its density may be infinite at 0
        nodes, steps = np.polynomial.legendre.leggauss(_NODES)
        t = (nodes + 1) / 2
        u, step = residual * t**2, residual * t * steps
        rest = _log_density(residual - u, others * visits)
        likelihood = np.exp(_log_density(u / variances[:, None], visits) + rest) @ step / variances
    else:
        likelihood = np.exp(_log_density(residual / variances, visits)) / variances
    prior = np.r_[_AS_TOLD, np.full(len(_EXCESSES), (1 - _AS_TOLD) / len(_EXCESSES))]
    weights = likelihood * prior
    total = float(weights.sum())
    # residuals beyond all variances, or far below what the covariances tell
    return (
        weights / total
        if total > 0
        else np.eye(len(variances))[-1 if residual > visits * (others + 1) else 0]
    )


def _log_density(x: np.ndarray, freedom: float) -> np.ndarray:
    """Logarithm of the density of the χ²-distribution."""
    half = freedom / 2
    return (half - 1) * np.log(x) - x / 2 - half * math.log(2) - math.lgamma(half)
