"""Least singular value and condition number of an observation matrix as smooth criteria of M = WᵀW."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_POWER = 8.0
"""Order of the norms that approximate extreme eigenvalues: close ones are moved together, so that searches end sooner, and higher."""


@dataclass(frozen=True)
class SmoothMinimumEigenvalue:
    """½ log of the harmonic mean of order 8 of M's eigenvalues: E-optimality, smooth where eigenvalues meet."""

    name: str = "E"
    uses_prior: bool = True

    def merit(self, information: np.ndarray) -> float:
        """Merit of M; -inf if M is singular."""
        values = np.linalg.eigvalsh(information)
        return -_extreme(values, -_POWER)[0] if values[0] > 0 else -np.inf

    def gradient(self, information: np.ndarray) -> np.ndarray:
        """Derivative (p, p) by M, symmetric."""
        values, vectors = np.linalg.eigh(information)
        return -(vectors * _extreme(values, -_POWER)[1]) @ vectors.T


@dataclass(frozen=True)
class ConditionNumberCriterion:
    """-log cond(W) of W with columns of unit norm (Gautier & Khalil 1992; van der Sluis 1969 for the scaling), with norms of order 8."""

    name: str = "condition"
    uses_prior: bool = False

    def merit(self, information: np.ndarray) -> float:
        """Merit of M; -inf if M is singular."""
        values = np.linalg.eigvalsh(_scaled(information)[0])
        return -_extreme(values, -_POWER)[0] - _extreme(values, _POWER)[0] if values[0] > 0 else -np.inf

    def gradient(self, information: np.ndarray) -> np.ndarray:
        """Derivative (p, p) by M, symmetric."""
        scaled, scale = _scaled(information)
        values, vectors = np.linalg.eigh(scaled)
        slope = -(vectors * (_extreme(values, -_POWER)[1] + _extreme(values, _POWER)[1])) @ vectors.T
        by_norm = np.einsum("ij,ij->i", slope, scaled)
        return scale[:, None] * slope * scale - np.diag(by_norm * scale**2)


def condition_number(information: np.ndarray) -> float:
    """Condition number cond(W) of W with columns of unit norm from M = WᵀW (p, p); inf if M is singular."""
    values = np.linalg.eigvalsh(_scaled(information)[0])
    return float(np.sqrt(values[-1] / values[0])) if values[0] > 0 else np.inf


def _extreme(values: np.ndarray, power: float) -> tuple[float, np.ndarray]:
    """Smooth extreme ½ |1/power| log Σ λ^power: of the largest for a positive power, minus that of the least for a negative; and its
    slopes.
    """
    logs = power * np.log(values)
    total = np.logaddexp.reduce(logs)
    return float(0.5 * total / abs(power)), 0.5 * np.sign(power) * np.exp(logs - total) / values


def _scaled(information: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    scale = 1 / np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    return scale[:, None] * information * scale, scale
