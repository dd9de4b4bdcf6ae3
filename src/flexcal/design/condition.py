"""The condition number of the column-scaled observation matrix, as a criterion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ColumnCondition:
    """-log cond(W) of W with columns of unit norm, from M = WᵀW (Gautier & Khalil 1992; van der Sluis 1969 for the scaling)."""

    name: str = "condition"
    uses_prior: bool = False

    def merit(self, information: np.ndarray) -> float:
        """-inf where M is singular."""
        values = np.linalg.eigvalsh(_scaled(information)[0])
        return float(0.5 * np.log(values[0] / values[-1])) if values[0] > 0 else -np.inf

    def gradient(self, information: np.ndarray) -> np.ndarray:
        """Derivative (p, p) of the merit by M, symmetric; of simple extreme eigenvalues."""
        scaled, scale = _scaled(information)
        values, vectors = np.linalg.eigh(scaled)
        least, most = vectors[:, :1] / np.sqrt(values[0]), vectors[:, -1:] / np.sqrt(values[-1])
        slope = 0.5 * (least @ least.T - most @ most.T)
        by_norm = np.einsum("ij,ij->i", slope, scaled)
        return scale[:, None] * slope * scale - np.diag(by_norm * scale**2)


def condition_number(information: np.ndarray) -> float:
    """cond(W) of W with columns of unit norm from M = WᵀW (p, p); inf where M is singular."""
    return float(np.exp(-ColumnCondition().merit(information)))


def _scaled(information: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    scale = 1 / np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    return scale[:, None] * information * scale, scale
