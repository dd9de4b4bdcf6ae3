"""Losses on the norm of a whitened residual group."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexcal.errors import FlexcalError

OUTLIER_WEIGHT = 0.2
"""A group is listed as an outlier when its robust weight is below this: Huber beyond 6.7 σ, Cauchy beyond 4.8 σ."""


class Loss(Protocol):
    """ρ(s) of the group norm s (G,), with ρ(s) → s²/2 for small s, and thresholds c (G,)."""

    def thresholds(self, sizes: np.ndarray) -> np.ndarray:
        """c (G,) for groups of `sizes` (G,) rows."""
        ...

    def cost(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        """ρ(s) (G,)."""
        ...

    def weight(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        """w(s) = ρ'(s)/s (G,), one at s = 0."""
        ...

    def curvature(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        """ρ''(s) (G,)."""
        ...


@dataclass(frozen=True)
class Squares:
    """Least squares: ρ = s²/2."""

    def thresholds(self, sizes: np.ndarray) -> np.ndarray:
        return np.ones(sizes.shape)

    def cost(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        return 0.5 * norm**2

    def weight(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        return np.ones(norm.shape)

    def curvature(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        return np.ones(norm.shape)


@dataclass(frozen=True)
class Huber:
    """Quadratic up to c, linear beyond (Huber 1964); convex, 95 % efficient for Gaussian noise.

    `threshold` is c in standard deviations for a group of one row; a larger group gets the c that Gaussian noise exceeds
    equally often.
    """

    threshold: float = 1.345

    def thresholds(self, sizes: np.ndarray) -> np.ndarray:
        return _same_tail(self.threshold, sizes)

    def cost(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        return np.where(norm <= threshold, 0.5 * norm**2, threshold * (norm - 0.5 * threshold))

    def weight(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        return threshold / np.maximum(norm, threshold)

    def curvature(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        return (norm <= threshold).astype(float)


@dataclass(frozen=True)
class Cauchy:
    """ρ = c²/2 log(1 + s²/c²): gross outliers have no influence; not convex, so start near the solution or from several starts.

    `threshold` as for `Huber`; the default is 95 % efficient for Gaussian noise.
    """

    threshold: float = 2.385

    def thresholds(self, sizes: np.ndarray) -> np.ndarray:
        return _same_tail(self.threshold, sizes)

    def cost(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        return 0.5 * threshold**2 * np.log1p((norm / threshold) ** 2)

    def weight(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        return 1.0 / (1.0 + (norm / threshold) ** 2)

    def curvature(self, norm: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        square = (norm / threshold) ** 2
        return (1.0 - square) / (1.0 + square) ** 2


_LOSSES: dict[str, Loss] = {"squares": Squares(), "huber": Huber(), "cauchy": Cauchy()}


def loss_named(loss: Loss | str) -> Loss:
    """The loss itself, or the default one of that name; raises FlexcalError for an unknown name."""
    if not isinstance(loss, str):
        return loss
    if loss not in _LOSSES:
        raise FlexcalError(
            "E-FIT-006",
            f"There is no loss '{loss}'; use {', '.join(_LOSSES)} or an object such as Huber(1.345).",
        )
    return _LOSSES[loss]


def _same_tail(threshold: float, sizes: np.ndarray) -> np.ndarray:
    """The norms that Gaussian groups of `sizes` rows exceed as often as a single row exceeds `threshold`."""
    from scipy.special import chdtri

    tail = math.erfc(threshold / math.sqrt(2.0))
    return np.sqrt(chdtri(sizes, tail))
