"""Weights of the complex errors of a measured frequency response (W of Eq. 26)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexcal.frequency.periodic import FrequencyResponse, vec


class Weighting(Protocol):
    """Interface from the covariance of the errors of one pose to a factor of the weight."""

    def factor(self, response: FrequencyResponse, covariance: np.ndarray) -> np.ndarray:
        """F (L, m n, m n) with the cost Σ ‖F Δ‖² over complex errors Δ of vec G (column-major) of `covariance` (L, m n, m n), for the m
        outputs and n axes of `response`."""
        ...


@dataclass(frozen=True)
class CovarianceWeighting:
    """Inverse of the measured covariance, by its Cholesky factor: the default, and maximum likelihood if the covariance is correct."""

    def factor(self, response: FrequencyResponse, covariance: np.ndarray) -> np.ndarray:
        std = np.sqrt(np.real(np.diagonal(covariance, axis1=1, axis2=2)))
        lower = np.linalg.cholesky(covariance / (std[:, :, None] * std[:, None, :]))
        identity = np.broadcast_to(np.eye(lower.shape[-1]), lower.shape)
        return np.linalg.solve(lower, identity) / std[:, None, :]


@dataclass(frozen=True)
class UniformWeighting:
    """Equal weights of all elements and lines, of a size that the expected cost of a pose is that of its number of errors."""

    def factor(self, response: FrequencyResponse, covariance: np.ndarray) -> np.ndarray:
        return _normalised(np.ones(covariance.shape[:2]), covariance)


@dataclass(frozen=True)
class ResonanceWeighting:
    """The paper's weights: uniform, amplified near poles and zeros of the diagonal elements, reduced for the others.

    The paper says no more than that. Here the error of G_ii is multiplied by up to `emphasis` within about `width` (relative
    frequency) of an extremum of |Ĝ_ii| that stands out by `prominence` (a factor), that of an off-diagonal by `coupling`. The size is
    as of `UniformWeighting`.
    """

    emphasis: float = 3.0
    width: float = 0.05
    coupling: float = 0.2
    prominence: float = 1.5

    def factor(self, response: FrequencyResponse, covariance: np.ndarray) -> np.ndarray:
        n = response.response.shape[-1]
        weight = np.full(response.stacked.shape, self.coupling)
        logarithm = np.log(response.frequencies_hz)
        for i in range(n):
            weight[:, i, i] = 1.0
            for at in extrema(np.log(np.abs(response.response[:, i, i])), np.log(self.prominence)):
                near = np.exp(-0.5 * ((logarithm - logarithm[at]) / self.width) ** 2)
                weight[:, i, i] = np.maximum(weight[:, i, i], 1 + (self.emphasis - 1) * near)
        return _normalised(vec(weight), covariance)


def _normalised(weight: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Factor (L, k, k) of weights (L, k) for errors of `covariance` (L, k, k), with 1 the mean expected square."""
    variance = np.real(np.diagonal(covariance, axis1=1, axis2=2))
    weight = weight / np.sqrt(np.mean(weight**2 * variance))
    return weight[:, :, None] * np.eye(weight.shape[1])


def extrema(curve: np.ndarray, prominence: float) -> list[int]:
    """Indices of the alternating maxima and minima of `curve` (L,) that differ by more than `prominence` from one to the next."""
    positions: list[int] = []
    low = high = 0
    rising: bool | None = None
    for k, value in enumerate(curve):
        high = k if value > curve[high] else high
        low = k if value < curve[low] else low
        if rising is not False and value < curve[high] - prominence:
            positions += [high] if high > 0 else []
            rising, low = False, k
        elif rising is not True and value > curve[low] + prominence:
            positions += [low] if low > 0 else []
            rising, high = True, k
        if rising is True:
            low = k
        elif rising is False:
            high = k
    return positions
