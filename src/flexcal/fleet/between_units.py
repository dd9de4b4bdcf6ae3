"""Random effects: values of several units, each measured with its own known uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

_LEVEL = 0.95


@dataclass(frozen=True)
class RandomEffects:
    """Distribution of a quantity over units, with the uncertainty of its measurements removed.

    Attributes
    ----------
    mean, mean_std : float
        Mean over the units, and its standard deviation.
    spread : float
        Standard deviation between units; 0 where the measurements' own uncertainty explains all differences.
    spread_low, spread_high : float
        Its 95 % interval.
    """

    mean: float
    mean_std: float
    spread: float
    spread_low: float
    spread_high: float


def random_effects(values: np.ndarray, std: np.ndarray) -> RandomEffects:
    """Mean of, and spread between, units from values (N,) with standard deviations (N,) of measurement; N is two or more.

    The variance between units is that of Paule and Mandel (1982, J. Res. NBS 87), where the weighted sum of squares about the weighted
    mean equals its expectation N − 1; its interval is where that sum equals quantiles of χ² with N − 1 degrees of freedom (Viechtbauer
    2007, Stat. Med. 26, Q-profile), which is exact for normal distributions.
    """
    from scipy.stats import chi2

    freedom = len(values) - 1
    targets = (
        float(freedom),
        float(chi2.ppf((1 + _LEVEL) / 2, freedom)),
        float(chi2.ppf((1 - _LEVEL) / 2, freedom)),
    )
    between, low, high = (variance_at(values, std, target) for target in targets)
    mean, mean_variance = weighted_mean(values, std, between)
    return RandomEffects(
        mean, math.sqrt(mean_variance), math.sqrt(between), math.sqrt(low), math.sqrt(max(high, between))
    )


def weighted_mean(values: np.ndarray, std: np.ndarray, between: float) -> tuple[float, float]:
    """Weighted mean of values, and its variance, with the variance `between` units."""
    weights = 1.0 / (std**2 + between)
    total = float(weights.sum())
    return float(weights @ values) / total, 1.0 / total


def variance_at(values: np.ndarray, std: np.ndarray, target: float) -> float:
    """Variance between units at which the weighted sum of squares about the weighted mean is `target`; 0 where it is smaller without."""
    from scipy.optimize import brentq

    scale = float(values.var() + (std**2).max())
    if not scale > 0:
        return 0.0
    tiny = 1e-12 * scale  # for values without uncertainty

    def excess(between: float) -> float:
        mean, _ = weighted_mean(values, std, between + tiny)
        return float(((values - mean) ** 2 / (std**2 + between + tiny)).sum()) - target

    if excess(0.0) <= 0:
        return 0.0
    high = scale
    while excess(high) > 0:
        high *= 4.0
    return float(brentq(excess, 0.0, high, xtol=1e-12 * scale))  # pyright: ignore
