"""Linear least squares with two variance components: correlated errors of uncertain size, and independent noise of unknown size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError

_RANGE = 3.5
"""Decades of the standard deviation of the noise that are integrated over, up to 30 times the residual."""
_STEP = 0.14
"""Largest step of the logarithm of that standard deviation."""
_SMALLEST = 1e-9
"""Least standard deviation of the noise, in the unit of the observations."""
_NEGLIGIBLE = 1e-6
"""Relative weight below which a pair of sizes is left out."""
_LEAST_FREEDOM = 2.0


@dataclass(frozen=True, eq=False)
class TwoVarianceFit:
    """Solution of `fit_two_variances`.

    Attributes
    ----------
    values : ndarray
        Estimates (p,).
    covariance : ndarray
        Covariance (p, p): the square of the scale of a Student distribution with `freedom` degrees of freedom.
    freedom : float
        Degrees of freedom of the intervals, 2 or more.
    size : float
        Size of the correlated errors, relative to the given covariance.
    noise : float
        Standard deviation of the independent noise.
    noise_freedom : float
        Degrees of freedom with which the variance of both together is known.
    median_noise : float
        Median of the standard deviation of the noise, which is less than `noise` where few residuals tell it.
    """

    values: np.ndarray
    covariance: np.ndarray
    freedom: float
    size: float
    noise: float
    noise_freedom: float
    median_noise: float

    def variance(self, covariance: np.ndarray) -> np.ndarray:
        """Covariance (m, m) of both errors together, where that of the correlated ones of size 1 is `covariance` (m, m)."""
        return self.size**2 * covariance + self.noise**2 * np.eye(len(covariance))


def fit_two_variances(
    design: np.ndarray,
    observed: np.ndarray,
    covariance: np.ndarray,
    sizes: Mapping[float, float],
    noise: float | None = None,
) -> TwoVarianceFit:
    """Fit observed = design · x + e with the covariance s² · covariance + σ² · I of e, integrated over s and σ.

    Both sizes are nuisances: the likelihood of the residual space (Patterson and Thompson 1971), as a function of s and σ, weights the
    generalised least-squares solutions of all pairs (Harville 1977); σ has the prior 1 / (σ + s a), where a is the root mean square of the
    correlated errors. Without these the result is ordinary least squares with its Student intervals.

    Parameters
    ----------
    design : ndarray
        Design matrix (m, p) of full column rank.
    observed : ndarray
        Observations (m,).
    covariance : ndarray
        Covariance (m, m) of the correlated errors of size 1.
    sizes : mapping of float
        Prior probability of each size s, up to a factor.
    noise : float, optional
        Standard deviation σ of the noise, where it is known.

    Returns
    -------
    TwoVarianceFit
        Estimates and their uncertainty.

    Raises
    ------
    FlexcalError
        Where there are no more observations than unknowns and `noise` is not given.
    """
    return _fit(design, observed, covariance, sizes, noise, weighted=True)


def least_squares_of_two_variances(
    design: np.ndarray,
    observed: np.ndarray,
    covariance: np.ndarray,
    sizes: Mapping[float, float],
    noise: float | None = None,
) -> TwoVarianceFit:
    """Ordinary least squares, with errors as in `fit_two_variances`, in whose place it stands where residuals shall be least.

    Parameters, result and errors are those of `fit_two_variances`.
    """
    return _fit(design, observed, covariance, sizes, noise, weighted=False)


def _fit(
    design: np.ndarray,
    observed: np.ndarray,
    covariance: np.ndarray,
    sizes: Mapping[float, float],
    noise: float | None,
    *,
    weighted: bool,
) -> TwoVarianceFit:
    rows, count = design.shape
    if rows <= count and noise is None:
        raise FlexcalError(
            "E-TOOL-001",
            f"{rows} observations leave no residual for {count} unknowns; give more, or the standard deviation of the noise.",
        )
    basis = np.linalg.qr(design, mode="complete")[0][:, count:]
    inverse = np.linalg.pinv(design)
    spectrum, vectors = np.linalg.eigh(basis.T @ covariance @ basis)
    spectrum, across = np.maximum(spectrum, 0.0), basis @ vectors
    left = across.T @ observed
    shared = float(np.sqrt(np.trace(covariance) / rows))
    sigmas = _noise_grid(left) if noise is None else np.array([noise])
    pairs, levels = [], []
    for size, weight in sizes.items():
        variance = np.maximum(size**2 * spectrum + sigmas[:, None] ** 2, _SMALLEST**2)
        level = -0.5 * (np.log(variance) + left**2 / variance).sum(axis=1)
        levels.append(
            level + np.log(weight * sigmas / (sigmas + size * shared))
            if noise is None
            else level + np.log(weight)
        )
        pairs.append(np.stack([np.full(len(sigmas), size), sigmas], axis=1))
    level, pair = np.concatenate(levels), np.concatenate(pairs)
    probability = np.exp(level - level.max())
    kept = probability > _NEGLIGIBLE
    probability, pair = probability[kept] / probability[kept].sum(), pair[kept]
    mixed, correlated = inverse @ covariance @ across, inverse @ covariance @ inverse.T
    independent, ordinary = inverse @ inverse.T, inverse @ observed
    values, covariances = np.empty((len(pair), count)), np.empty((len(pair), count, count))
    for k, (size, sigma) in enumerate(pair):
        gain = (
            size**2 / np.maximum(size**2 * spectrum + sigma**2, _SMALLEST**2) if weighted else 0.0 * spectrum
        )
        values[k] = ordinary - mixed @ (gain * left)
        covariances[k] = size**2 * (correlated - (mixed * gain) @ mixed.T) + sigma**2 * independent
    mean = probability @ values
    off = values - mean
    variances = np.maximum(np.einsum("kii->ki", covariances), _SMALLEST**2)
    precision = np.einsum("k,kij->ij", probability, np.linalg.inv(covariances + _SMALLEST**2 * np.eye(count)))
    total = pair[:, 0] ** 2 * shared**2 + pair[:, 1] ** 2
    return TwoVarianceFit(
        mean,
        np.linalg.inv(precision) + (off * probability[:, None]).T @ off,
        max(_LEAST_FREEDOM, float(_freedom(probability, variances).min())),
        float(probability @ pair[:, 0]),
        float(np.sqrt(probability @ pair[:, 1] ** 2)),
        float(_freedom(probability, np.maximum(total, _SMALLEST**2)[:, None])[0]),
        _median(pair[:, 1], probability),
    )


def _median(values: np.ndarray, probability: np.ndarray) -> float:
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(probability[order]), 0.5)])


def _noise_grid(left: np.ndarray) -> np.ndarray:
    """Standard deviations of the noise, equally spaced in their logarithm: closer where many residuals know it better."""
    largest = 30 * float(np.sqrt(np.mean(left**2))) + 30 * _SMALLEST
    step = min(_STEP, 0.5 / np.sqrt(2 * len(left)))
    return largest * np.exp(-step * np.arange(int(_RANGE * np.log(10) / step)))


def _freedom(probability: np.ndarray, variances: np.ndarray) -> np.ndarray:
    """Degrees of freedom (p,) of the scaled inverse χ² distributions with the mean and variance of 1 / `variances` (k, p)."""
    inverse = 1.0 / variances
    mean = probability @ inverse
    spread = probability @ (inverse / mean - 1.0) ** 2
    return 2.0 / np.maximum(spread, 1e-6)
