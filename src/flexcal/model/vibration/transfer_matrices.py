"""Motor torque to motor acceleration of the linearised robot: G(s) = s² F_Mᵀ (M s² + D s + K)⁻¹ B_M, and its derivatives.

Eq. (9) of the paper read literally inverts the motor-only sub-matrix, which has no arm resonances; this is what its figures show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.model.vibration.linearisation import Linearisation
from flexcal.model.vibration.sensor_outputs import SensorOutputs


@dataclass(frozen=True, eq=False)
class TransferMatrix:
    """`response` (lines, E + S, E) and `derivatives` (lines, E + S, E, c) by the parameters `names` (c,).

    Rows are the motors' accelerations in rad/s² per N m, then the readings of the S sensors of the linearised robot, where it has any.
    """

    response: np.ndarray
    names: tuple[str, ...]
    derivatives: np.ndarray


def transfer_matrix(
    system: Linearisation, frequencies_hz: np.ndarray, *, added: np.ndarray | float = 0.0
) -> TransferMatrix:
    """Evaluate G and its derivatives by all of `system.derivatives` at `frequencies_hz` (lines,), with a complex stiffness `added`
    (lines, d, d) that differs from line to line.

    With X = A⁻¹B, ∂G_ij = -s² Σ_ab X_ai X_bj (s² ∂M + s ∂D + ∂K)_ab. The products X X for a ≤ b and i ≤ j are formed once (both
    are symmetric), and multiply each kind's derivatives, stacked, in one real matrix product.
    """
    s = 2j * np.pi * np.asarray(frequencies_hz, dtype=float)
    count, size = system.inputs, len(system.mass)
    at = s[:, None, None]
    forces = np.broadcast_to(np.eye(size, count), (len(s), size, count))
    dynamics = at**2 * system.mass + at * system.damping + system.stiffness + added
    moved = np.linalg.solve(dynamics, forces)
    names = tuple(system.derivatives)
    response, change = at**2 * moved[:, :count], _derivatives(system, names, s, moved)
    if system.sensed is not None:
        rows = system.sensed.at(s)
        response = np.concatenate([response, rows @ moved], axis=1)
        change = np.concatenate(
            [change, _sensed_derivatives(system, system.sensed, names, s, dynamics, moved, rows)], axis=1
        )
    return TransferMatrix(response, names, change)


def _derivatives(
    system: Linearisation, names: tuple[str, ...], s: np.ndarray, moved: np.ndarray
) -> np.ndarray:
    count = system.inputs
    change = np.zeros((len(s), count, count, len(names)), dtype=complex)
    if not names:
        return change
    parts = [np.array(kind) for kind in zip(*system.derivatives.values(), strict=True)]
    used = np.logical_or.reduce([np.any(part != 0, axis=0) for part in parts])
    a, b = np.nonzero(np.triu(used))
    i, j = np.triu_indices(count)
    pairs = moved[:, a][:, :, i] * moved[:, b][:, :, j] + moved[:, b][:, :, i] * moved[:, a][:, :, j]
    pairs *= np.where(a == b, 0.5, 1.0)[:, None]
    table = np.asarray(np.moveaxis(pairs, 1, 2)).reshape(len(s) * len(i), len(a))
    table = np.vstack([np.real(table), np.imag(table)])
    upper = np.zeros((len(s), len(i), len(names)), dtype=complex)
    for power, part in zip((4, 3, 2), parts, strict=True):
        some = np.flatnonzero(np.any(part != 0, axis=(1, 2)))
        product = table @ part[some][:, a, b].T
        half = len(product) // 2
        product = (product[:half] + 1j * product[half:]).reshape(len(s), len(i), len(some))
        upper[:, :, some] -= s[:, None, None] ** power * product
    change[:, i, j] = upper
    change[:, j, i] = upper
    return change


def _sensed_derivatives(
    system: Linearisation,
    sensed: SensorOutputs,
    names: tuple[str, ...],
    s: np.ndarray,
    dynamics: np.ndarray,
    moved: np.ndarray,
    rows: np.ndarray,
) -> np.ndarray:
    """∂(o X) = ∂o X − Y (s² ∂M + s ∂D + ∂K) X (lines, S, E, c), with Y = o A⁻¹, A being symmetric."""
    if not names:
        return np.zeros((len(s), len(sensed), system.inputs, 0), dtype=complex)
    pulled = np.linalg.solve(dynamics, np.swapaxes(rows, 1, 2))  # A⁻¹ oᵀ (lines, E + d, S)
    parts = [np.array(kind) for kind in zip(*system.derivatives.values(), strict=True)]
    a, b = np.nonzero(np.logical_or.reduce([np.any(part != 0, axis=0) for part in parts]))
    table = (pulled[:, a][:, :, :, None] * moved[:, b][:, :, None, :]).transpose(0, 2, 3, 1)
    change = np.einsum("lsan,laj->lsjn", sensed.changes(s, names), moved, optimize=True)
    for power, part in zip((2, 1, 0), parts, strict=True):
        some = np.flatnonzero(np.any(part != 0, axis=(1, 2)))
        change[..., some] -= s[:, None, None, None] ** power * (table @ part[some][:, a, b].T)
    return change
