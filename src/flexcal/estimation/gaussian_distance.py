"""Distance due to a three-dimensional Gaussian error: mean, 95 % quantile and probability."""

from __future__ import annotations

from functools import cache

import numpy as np

_DEGREE = 14
"""Degree of the Chebyshev series for the quantile, in each of two ratios of standard deviations; accurate to 2e-6 of the quantile."""
_KNOWN = 1e9
"""Degrees of freedom from which variances count as known."""
_DIRECTIONS = 24
"""Number of nodes per coordinate of the quadrature over an octant of directions."""
_NO_VARIANCE, _DUPLICATIONS = 1e-280, 13
"""Least ratio of the middle variance to the largest, and the number of duplications after which arguments of any ratio down to it differ
by less than 0.3 %, from where the series of the elliptic integrals are exact to rounding."""


def principal_variances(covariance: np.ndarray) -> np.ndarray:
    """Eigenvalues (N, 3) of `covariance` (N, 3, 3), the largest first; none below zero."""
    return np.maximum(np.linalg.eigvalsh(covariance)[:, ::-1], 0.0)


def mean_distance(variances: np.ndarray) -> np.ndarray:
    """Expected length (N,) of zero-mean Gaussian vectors with principal `variances` (N, 3).

    √(8/π) R_G(λ1, λ2, λ3) with the eigenvalues λ and Carlson's symmetric elliptic integral of the second kind, which is the mean of
    √(Σ λ u²) over all directions u (Carlson, Numerical Algorithms, 1995). `scipy.special.elliprg` gives the same to 1e-14, but its import
    takes a tenth of a verb's time.
    """
    ordered = np.sort(np.maximum(variances, 0.0), axis=1)
    size = ordered[:, 2]
    y, z, x = (ordered / np.where(size > 0, size, 1.0)[:, None]).T
    x, z = np.where(size > 0, x, 1.0), np.maximum(z, _NO_VARIANCE)  # z the middle one: no difference cancels
    first, second = _symmetric_integrals(x, y, z)
    return np.sqrt(8 / np.pi * size) * 0.5 * (z * first + (x - z) * (z - y) * second / 3 + np.sqrt(x * y / z))


def _symmetric_integrals(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """R_F and R_D (N,) of `x`, `y`, `z` (N,), by duplications, which make them alike, and series (Carlson 1995, sections 2 and 4)."""
    power, total = 1.0, np.zeros_like(x)
    for _ in range(_DUPLICATIONS):
        roots = np.sqrt([x, y, z])
        shift = roots[0] * roots[1] + roots[0] * roots[2] + roots[1] * roots[2]
        total = total + power / (roots[2] * (z + shift))
        x, y, z, power = (x + shift) / 4, (y + shift) / 4, (z + shift) / 4, power / 4
    mean, weighted = (x + y + z) / 3, (x + y + 3 * z) / 5
    a, b = 1 - x / mean, 1 - y / mean
    c = -a - b
    e2, e3 = a * b - c * c, a * b * c
    first = (1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44) / np.sqrt(mean)
    a, b = 1 - x / weighted, 1 - y / weighted
    c = -(a + b) / 3
    e2, e3 = a * b - 6 * c * c, (3 * a * b - 8 * c * c) * c
    e4, e5 = 3 * (a * b - c * c) * c * c, a * b * c**3
    series = 1 - 3 * e2 / 14 + e3 / 6 + 9 * e2 * e2 / 88 - 3 * e4 / 22 - 9 * e2 * e3 / 52 + 3 * e5 / 26
    return first, 3 * total + power * series / (weighted * np.sqrt(weighted))


def distance_quantile(variances: np.ndarray) -> np.ndarray:
    """Length (N,) that zero-mean Gaussian vectors with principal `variances` (N, 3), the largest first, exceed in 5 of 100 cases.

    Right to 2e-6 of it: the exact quantile at the nodes of a Chebyshev series in the ratios of the standard deviations, middle to
    largest and smallest to middle.
    """
    largest, middle, smallest = np.sqrt(variances).T
    first = np.divide(middle, largest, out=np.zeros_like(middle), where=largest > 0)
    second = np.divide(smallest, middle, out=np.zeros_like(middle), where=middle > 0)
    return largest * np.polynomial.chebyshev.chebval2d(2 * first - 1, 2 * second - 1, _series())


def distance_probability(distance: np.ndarray, variances: np.ndarray, freedom: float = np.inf) -> np.ndarray:
    """Probability (N,) that zero-mean Gaussian vectors with principal `variances` (N, 3) are no longer than `distance` (N,).

    The mean over all directions of the probability that a length with three degrees of freedom stays within the ellipsoid's. Where the
    variances are themselves estimated with finite `freedom`, that of Student's multivariate t.
    """
    from scipy.special import fdtr

    squares, weights = _quadrature()
    along = np.maximum(variances @ squares.T, np.finfo(float).tiny)
    return fdtr(3.0, min(freedom, _KNOWN), distance[:, None] ** 2 / (3 * along)) @ weights


@cache
def _quadrature() -> tuple[np.ndarray, np.ndarray]:
    """Squared direction cosines (K, 3) over an octant of the unit sphere, and weights (K,) that add to one."""
    nodes, weights = np.polynomial.legendre.leggauss(_DIRECTIONS)
    height, angle = 0.5 * (nodes + 1), 0.25 * np.pi * (nodes + 1)
    z, phi = (grid.ravel() for grid in np.meshgrid(height, angle, indexing="ij"))
    across = 1 - z**2
    squares = np.stack([z**2, across * np.cos(phi) ** 2, across * np.sin(phi) ** 2], axis=1)
    return squares, 0.25 * np.outer(weights, weights).ravel()


@cache
def _series() -> np.ndarray:
    """Coefficients of the 95 % quantile in units of the largest standard deviation."""
    points = np.polynomial.chebyshev.chebpts1(_DEGREE + 1)
    first, second = (0.5 * (grid.ravel() + 1) for grid in np.meshgrid(points, points, indexing="ij"))
    variances = np.stack([np.ones_like(first), first**2, (first * second) ** 2], axis=1)
    squares, weights = _quadrature()
    along = np.sqrt(variances @ squares.T)
    value = np.full(len(first), 2.3)
    for _ in range(
        8
    ):  # Newton's steps; the density is that of the chi distribution with three degrees of freedom along every direction
        ratio = value[:, None] / along
        density = np.sqrt(2 / np.pi) * (ratio**2 * np.exp(-0.5 * ratio**2) / along) @ weights
        value = value - (distance_probability(value, variances) - 0.95) / density
    back = np.linalg.inv(np.polynomial.chebyshev.chebvander(points, _DEGREE))
    return back @ value.reshape(_DEGREE + 1, _DEGREE + 1) @ back.T
