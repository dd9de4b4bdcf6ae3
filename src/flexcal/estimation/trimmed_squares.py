"""Groups of observations that agree with each other, by least trimmed squares and tests of the others one by one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexcal.estimation.two_variances import TwoVarianceFit, fit_two_variances

_FALSE_ALARM = 0.01
"""Probability that any of the groups is excluded where none is wrong."""
_STARTS = 60
"""Largest number of groups for which fits without each one are starts too."""
_STEPS = 30
_FLAT = 1e-9
"""Least residual norm, in the unit of the observations, that lowers a weight."""


def consistent_groups(
    design: np.ndarray,
    observed: np.ndarray,
    covariance: np.ndarray,
    sizes: Mapping[float, float],
    groups: np.ndarray,
    strata: np.ndarray,
) -> np.ndarray:
    """Mask (G,) of the groups of observations that one linear model explains, for errors as in `fit_two_variances`.

    Least trimmed squares (Rousseeuw and Van Driessen 2006) gives a core of a little more than half of each stratum. Others join it while
    their distance from the prediction is not significant, all together at a level of 1 % (Hadi and Simonoff 1993); then those leave that
    the others do not predict.

    Parameters
    ----------
    design, observed, covariance, sizes
        As in `fit_two_variances`.
    groups : ndarray
        Group (m,) of each observation, from 0.
    strata : ndarray
        Stratum (G,) of each group; of every one a core of at least two groups is kept.

    Returns
    -------
    ndarray
        Whether each group agrees with the others.
    """
    data = _Data(design, observed, covariance, sizes, groups)
    count = len(strata)
    core = _trimmed_core(data, strata)
    while not core.all():
        fit = data.fit(core)
        outside = np.flatnonzero(~core)
        near = [g for g in outside if data.is_near(fit, core, int(g), count)]
        if not near:
            break
        core[near] = True
    least = np.array([core_size(int(np.sum(strata == name))) for name in strata])
    while True:
        inside = np.array([int(np.sum(core & (strata == name))) for name in strata])
        candidates = np.flatnonzero(core & (inside > least))
        if not candidates.size:
            return core
        norms = data.norms(data.least_squares(core))
        worst = int(candidates[np.argmax(norms[candidates])])
        rest = core.copy()
        rest[worst] = False
        if data.is_near(data.fit(rest), rest, worst, count):
            return core
        core = rest


class _Data:
    def __init__(
        self,
        design: np.ndarray,
        observed: np.ndarray,
        covariance: np.ndarray,
        sizes: Mapping[float, float],
        groups: np.ndarray,
    ) -> None:
        self.design, self.observed, self.covariance, self.sizes = design, observed, covariance, sizes
        self.groups = groups

    def fit(self, chosen: np.ndarray) -> TwoVarianceFit:
        rows = chosen[self.groups]
        return fit_two_variances(
            self.design[rows], self.observed[rows], self.covariance[np.ix_(rows, rows)], self.sizes
        )

    def least_squares(self, chosen: np.ndarray) -> np.ndarray:
        rows = chosen[self.groups]
        return np.linalg.lstsq(self.design[rows], self.observed[rows], rcond=None)[0]

    def norms(self, values: np.ndarray) -> np.ndarray:
        """Norm (G,) of the residuals of every group."""
        squares = (self.observed - self.design @ values) ** 2
        return np.sqrt(np.bincount(self.groups, squares))

    def is_near(self, fit: TwoVarianceFit, chosen: np.ndarray, group: int, count: int) -> bool:
        """Whether a group is where the `chosen` ones predict it, by an F test."""
        from scipy.special import fdtri

        inside, own = np.flatnonzero(chosen[self.groups]), np.flatnonzero(self.groups == group)
        both = np.concatenate([inside, own])
        variance = fit.variance(self.covariance[np.ix_(both, both)])
        m = len(inside)
        gain = np.linalg.solve(variance[:m, :m], variance[:m, m:]).T
        residual = self.observed[both] - self.design[both] @ fit.values
        error = residual[m:] - gain @ residual[:m]
        slope = self.design[own] - gain @ self.design[inside]
        spread = variance[m:, m:] - gain @ variance[:m, m:] + slope @ fit.covariance @ slope.T
        distance = float(error @ np.linalg.solve(spread, error)) / len(own)
        return distance <= float(fdtri(len(own), fit.noise_freedom, 1 - _FALSE_ALARM / count))


def core_size(groups: int) -> int:
    """Number of groups of a stratum of so many that its core has."""
    return min(groups, max(2, (groups + 3) // 2))


def _trimmed_core(data: _Data, strata: np.ndarray) -> np.ndarray:
    """Mask (G,) of the groups with the least sum of squares, so many of every stratum, from the best of several starts."""
    every = np.ones(len(strata), dtype=bool)
    starts = [every]
    if len(strata) <= _STARTS:
        starts += [np.arange(len(strata)) != g for g in range(len(strata)) if np.sum(strata == strata[g]) > 2]
    best, least = every, np.inf
    for start in starts:
        norms = data.norms(_least_norms(data, start))
        core = _closest(norms, strata)
        for _ in range(_STEPS):
            norms = data.norms(data.least_squares(core))
            closer = _closest(norms, strata)
            if (closer == core).all():
                break
            core = closer
        cost = float(np.sum(norms[core] ** 2))
        if cost < least * (1 - 1e-9):
            best, least = core, cost
    return best


def _closest(norms: np.ndarray, strata: np.ndarray) -> np.ndarray:
    core = np.zeros(len(norms), dtype=bool)
    for name in dict.fromkeys(strata.tolist()):
        own = np.flatnonzero(strata == name)
        core[own[np.argsort(norms[own], kind="stable")[: core_size(len(own))]]] = True
    return core


def _least_norms(data: _Data, chosen: np.ndarray) -> np.ndarray:
    """Values (p,) with the least sum of the norms of the chosen groups: reweighted least squares (Weiszfeld 1937)."""
    values = data.least_squares(chosen)
    rows = chosen[data.groups]
    for _ in range(_STEPS):
        weight = 1 / np.sqrt(np.maximum(data.norms(values), _FLAT))[data.groups][rows]
        values = np.linalg.lstsq(
            data.design[rows] * weight[:, None], data.observed[rows] * weight, rcond=None
        )[0]
    return values
