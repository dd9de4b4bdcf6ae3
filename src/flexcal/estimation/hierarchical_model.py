"""Population of which several individuals were measured: mean and spread of its parameters, and the prior for the next individual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_SWEEPS, _BURN_IN = 1200, 300
_FREEDOMS = np.array([2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
"""Degrees of freedom, each as probable beforehand as the others, with which the variances of a kind resemble each other."""
_SMALLEST = 1e-8
"""Least variance of a parameter, relative to its plausible size squared: what rounding leaves."""

_FINITE_VARIANCE = 2.1
"""Least degrees of freedom of a spread, with which a Student distribution has a variance."""


@dataclass(frozen=True, eq=False)
class Measured:
    """What was measured of an individual: `rows` (k, p) times its parameters are `observed` (k,) with independent errors of variance 1."""

    rows: np.ndarray
    observed: np.ndarray


@dataclass(frozen=True, eq=False)
class Population:
    """Distribution of p parameters over the individuals of a population, as the measured ones tell it.

    `mean` (p,) and its covariance `uncertainty` (p, p); `spread` (p,), the standard deviation over individuals, root of the mean of its
    posterior variance, and the degrees of freedom (p,) with which that is known.
    """

    mean: np.ndarray
    uncertainty: np.ndarray
    spread: np.ndarray
    freedom: np.ndarray

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (p, p) of the parameters of a further individual about `mean`."""
        return self.uncertainty + np.diag(self.spread**2)


def normal_equations(measured: Sequence[Measured], sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Information (N, p, p) and right sides (N, p) of N individuals, with their parameters in units of `sizes` (p,)."""
    rows = [item.rows * sizes for item in measured]
    told = [own.T @ item.observed for own, item in zip(rows, measured, strict=True)]
    return np.array([own.T @ own for own in rows]), np.array(told)


def population(measured: Sequence[Measured], sizes: np.ndarray, kinds: Sequence[str]) -> Population:
    """Posterior of a normal hierarchical model, by a Gibbs sampler with a fixed seed.

    The parameters of an individual are normal about the mean of the population with independent variances. These resemble each other
    within a kind: they are scaled inverse chi-square about the variance of the kind, with degrees of freedom that are estimated too
    (Smyth 2004), and the standard deviation of a kind is half-normal with the plausible size (Gelman 2006); means are normal about zero
    with it. So with few individuals the variance of each is told by all parameters of the kind, and what remains uncertain of it widens the
    prior of the next (Gelman et al. 2013, chapter 5 and section 11.6). Directions that nobody measured keep the plausible size.

    Parameters
    ----------
    measured : sequence of Measured
        Individuals.
    sizes : ndarray
        Plausible sizes (p,), the units of the parameters.
    kinds : sequence of str
        Kind of every parameter, p names.

    Returns
    -------
    Population
        Mean, spread and their uncertainty.
    """
    rng = np.random.default_rng(0)
    count, size = len(measured), len(sizes)
    information, told = normal_equations(measured, sizes)
    names, kind = np.unique(np.asarray(kinds), return_inverse=True)
    members = np.bincount(kind, minlength=len(names))
    variance, common, freedom = np.full(size, 0.1), np.full(len(names), 0.1), np.full(len(names), 4.0)
    sums = _Sums(size)
    for sweep in range(_SWEEPS + _BURN_IN):
        precision = 1 / variance
        own = information.copy()
        own[:, range(size), range(size)] += precision
        root = np.linalg.inv(np.linalg.cholesky(own))
        inner = np.matmul(root.swapaxes(1, 2), root)
        # the mean, with the individuals integrated out
        whole = np.diag(1.0 + count * precision) - precision[:, None] * inner.sum(axis=0) * precision
        right = precision * np.einsum("ipq,iq->p", inner, told)
        uncertainty = np.linalg.inv(whole)
        uncertainty = (uncertainty + uncertainty.T) / 2
        centre = uncertainty @ right
        mean = centre + np.linalg.cholesky(uncertainty) @ rng.standard_normal(size)
        each = np.einsum("ipq,iq->ip", inner, told + precision * mean)
        each = each + np.einsum("iqp,iq->ip", root, rng.standard_normal((count, size)))
        squares = np.sum((each - mean) ** 2, axis=0)
        scale = freedom[kind] * common[kind] + squares
        if sweep >= _BURN_IN:
            sums.add(centre, uncertainty, scale, freedom[kind] + count)
        variance = np.maximum(scale / rng.chisquare(freedom[kind] + count), _SMALLEST)
        inverse = np.bincount(kind, 1 / variance)
        common = rng.gamma((freedom * members + 1) / 2, 2 / (freedom * inverse + 1))
        logarithms = np.bincount(kind, np.log(variance))
        freedom = _freedoms(rng, members, common, inverse, logarithms)
    return sums.population(sizes)


def individuals(spread: np.ndarray, freedom: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Deviations (count, p) from the mean of the population of individuals drawn from it.

    Those of each parameter have a Student distribution of the variance `spread` (p,) squared, as that is known with `freedom` (p,) degrees
    of freedom; at least 2.1, with which it has a variance.
    """
    freedom = np.maximum(freedom, _FINITE_VARIANCE)
    scale = spread * np.sqrt((freedom - 2) / freedom)
    return scale * rng.standard_t(freedom, (count, len(spread)))


def _freedoms(
    rng: np.random.Generator,
    members: np.ndarray,
    common: np.ndarray,
    inverse: np.ndarray,
    logarithms: np.ndarray,
) -> np.ndarray:
    """Degrees of freedom of every kind, drawn from what its variances say of them."""
    from scipy.special import gammaln

    half = _FREEDOMS[:, None] / 2
    density = members * (half * np.log(half * common) - gammaln(half)) - half * (
        common * inverse + logarithms
    )
    weights = np.exp(density - density.max(axis=0))
    below = np.cumsum(weights / weights.sum(axis=0), axis=0)
    return _FREEDOMS[np.minimum(np.sum(below < rng.random(len(members)), axis=0), len(_FREEDOMS) - 1)]


class _Sums:
    """Sums over sweeps of conditional moments, which scatter less than those of the draws (Gelfand and Smith 1990)."""

    def __init__(self, size: int) -> None:
        self.number = 0
        self.mean, self.variance, self.precision = np.zeros(size), np.zeros(size), np.zeros(size)
        self.product, self.uncertainty = np.zeros((size, size)), np.zeros((size, size))

    def add(
        self, centre: np.ndarray, uncertainty: np.ndarray, scale: np.ndarray, freedom: np.ndarray
    ) -> None:
        self.number += 1
        self.mean += centre
        self.product += np.outer(centre, centre)
        self.uncertainty += uncertainty
        self.variance += scale / (freedom - 2)
        self.precision += freedom / scale

    def population(self, sizes: np.ndarray) -> Population:
        mean, variance = self.mean / self.number, self.variance / self.number
        uncertainty = (self.uncertainty + self.product) / self.number - np.outer(mean, mean)
        ratio = variance * self.precision / self.number
        return Population(
            mean * sizes,
            uncertainty * np.outer(sizes, sizes),
            np.sqrt(variance) * sizes,
            2 * ratio / np.maximum(ratio - 1, 1e-9),
        )
