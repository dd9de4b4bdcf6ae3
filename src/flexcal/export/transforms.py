"""Placements as matrices (..., 4, 4) and as the six numbers that files have: x, y, z, roll, pitch, yaw."""

from __future__ import annotations

import numpy as np

from flexcal.model.parts import axis_rotations, rotation_rpy, rpy_rotation

XYZ_RPY: tuple[str, ...] = ("x", "y", "z", "roll", "pitch", "yaw")
X, Y, Z = np.eye(3)


def transform(position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Position (3,) and rotation (3, 3) as one matrix (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    return matrix


def xyz_rpy(placement: np.ndarray) -> dict[str, float]:
    """x, y, z (m), roll, pitch, yaw (rad) of a placement (4, 4) = Trans Rz(yaw) Ry(pitch) Rx(roll)."""
    values = [*placement[:3, 3], *rotation_rpy(placement[:3, :3])]
    return {key: float(value) + 0.0 for key, value in zip(XYZ_RPY, values, strict=True)}


def from_xyz_rpy(numbers: dict[str, float]) -> np.ndarray:
    """Placement (4, 4) of six numbers."""
    values = np.array([numbers[key] for key in XYZ_RPY], dtype=float)
    return transform(values[:3], rpy_rotation(values[3:]))


def turned(axis: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Rotations (..., 4, 4) by angles (...,), rad, about a unit vector (3,)."""
    result = np.zeros((*np.shape(angle), 4, 4))
    result[..., :3, :3] = axis_rotations(axis, angle)
    result[..., 3, 3] = 1.0
    return result


def shifted(axis: np.ndarray, length: np.ndarray | float) -> np.ndarray:
    """Translations (..., 4, 4) by lengths (...,), m, along a unit vector (3,)."""
    length = np.asarray(length, dtype=float)
    result = np.broadcast_to(np.eye(4), (*length.shape, 4, 4)).copy()
    result[..., :3, 3] = length[..., None] * axis
    return result
