"""Motor torque to motor acceleration of the linearised robot: G(s) = s² F_Mᵀ (M s² + D s + K)⁻¹ B_M, and its derivatives.

Eq. (9) of the paper read literally inverts the motor-only sub-matrix, which has no arm resonances; this is what its figures show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.model.linearisation import Linearisation


@dataclass(frozen=True, eq=False)
class TransferMatrix:
    """`response` (lines, E, E) in rad/s² per N m, and `derivatives` name → (lines, E, E)."""

    response: np.ndarray
    derivatives: dict[str, np.ndarray]


def transfer_matrix(system: Linearisation, frequencies_hz: np.ndarray) -> TransferMatrix:
    """Evaluate G and its derivatives at `frequencies_hz` (lines,): ∂G = -s² Xᵀ (s² ∂M + s ∂D + ∂K) X with X = A⁻¹ B."""
    s = 2j * np.pi * np.asarray(frequencies_hz, dtype=float)[:, None, None]
    count, size = system.inputs, len(system.mass)
    forces = np.broadcast_to(np.eye(size, count), (len(s), size, count))
    moved = np.linalg.solve(s**2 * system.mass + s * system.damping + system.stiffness, forces)
    turned = np.swapaxes(moved, 1, 2)
    derivatives = {}
    for name, parts in system.derivatives.items():
        change = np.zeros((len(s), count, count), dtype=complex)
        for power, part in zip((4, 3, 2), parts, strict=True):
            rows = np.flatnonzero(part.any(axis=1))
            if len(rows):
                change -= s**power * (turned[:, :, rows] @ (part[np.ix_(rows, rows)] @ moved[:, rows]))
        derivatives[name] = change
    return TransferMatrix(s**2 * moved[:, :count], derivatives)
