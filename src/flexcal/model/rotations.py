"""Rotations in the forms that files use."""

from __future__ import annotations

import numpy as np


def rpy_rotation(rpy: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) of URDF roll, pitch, yaw (rad): R_z(yaw) R_y(pitch) R_x(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rotation_rpy(rotation: np.ndarray) -> np.ndarray:
    """URDF roll, pitch, yaw (3,) of a rotation (3, 3), rad.

    Roll is read after yaw is taken out, so that near pitch ±90°, where only their combination is determined, the three still compose
    to the rotation.
    """
    cosine = np.hypot(rotation[0, 0], rotation[1, 0])
    pitch = np.arctan2(-rotation[2, 0], cosine)
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0]) if cosine > 0 else 0.0
    across = np.array([-np.sin(yaw), np.cos(yaw), 0.0]) @ rotation
    return np.array([np.arctan2(-across[2], across[1]), pitch, yaw])


def axis_rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation (3, 3) by `angle` (rad) about the unit vector `axis` (3,)."""
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew


def vector_rotation(vector: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) of a rotation vector (3,), rad."""
    angle = float(np.linalg.norm(vector))
    return axis_rotation(vector / angle, angle) if angle > 0 else np.eye(3)


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """Rotation vector (3,), rad, of a rotation (3, 3)."""
    w, x, y, z = rotation_wxyz(rotation)
    sine = float(np.linalg.norm([x, y, z]))
    if sine < 1e-15:
        return np.zeros(3)
    return 2 * np.arctan2(sine, w) / sine * np.array([x, y, z])


def rotation_wxyz(rotation: np.ndarray) -> np.ndarray:
    """Unit quaternion (4,), w first and not negative, of a rotation (3, 3): Shepperd's choice of the largest component."""
    r = rotation
    squares = np.array(
        [
            1 + np.trace(r),
            1 + r[0, 0] - r[1, 1] - r[2, 2],
            1 - r[0, 0] + r[1, 1] - r[2, 2],
            1 - r[0, 0] - r[1, 1] + r[2, 2],
        ]
    )
    k = int(np.argmax(squares))
    rows = np.array(
        [
            [squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], squares[1], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], squares[2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[3]],
        ]
    )
    q = rows[k] / np.linalg.norm(rows[k])
    return -q if q[0] < 0 else q
