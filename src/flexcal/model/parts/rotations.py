"""Conversions between rotation matrices, roll-pitch-yaw angles, rotation vectors and quaternions."""

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
    if angle == 0:
        return np.eye(3)
    skew = skew_matrix(axis)
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew


def axis_rotations(axis: np.ndarray, angles: np.ndarray | float) -> np.ndarray:
    """Rotations (..., 3, 3) by `angles` (...,) (rad) about the unit vector `axis` (3,): Rodrigues' formula."""
    skew, angles = skew_matrix(axis), np.asarray(angles, dtype=float)[..., None, None]
    return np.eye(3) + np.sin(angles) * skew + (1 - np.cos(angles)) * (skew @ skew)


def skew_matrix(vector: np.ndarray) -> np.ndarray:
    """Skew-symmetric matrix (3, 3) of a vector (3,): its product with a second vector is the cross product of both."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def vector_rotation(vector: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) of a rotation vector (3,), rad."""
    angle = float(np.linalg.norm(vector))
    return axis_rotation(vector / angle, angle) if angle > 0 else np.eye(3)


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3), rad, of rotations (..., 3, 3)."""
    wxyz = rotation_wxyz(rotation)
    sine = np.linalg.norm(wxyz[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, wxyz[..., :1])
    return np.where(sine < 1e-15, 0.0, angle / np.maximum(sine, 1e-15)) * wxyz[..., 1:]


def rotation_wxyz(rotation: np.ndarray) -> np.ndarray:
    """Unit quaternions (..., 4), w first and not negative, of rotations (..., 3, 3): Shepperd's choice of the largest component."""
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(rotation, (-2, -1), (0, 1))
    squares = np.stack([1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i])
    largest = np.argmax(squares, axis=0)
    q = np.stack([squares[0], h - f, c - g, d - b], axis=-1)
    others = (
        (h - f, squares[1], b + d, c + g),
        (c - g, b + d, squares[2], f + h),
        (d - b, c + g, f + h, squares[3]),
    )
    for k, components in enumerate(others, 1):
        own = largest == k
        if own.any():
            q = np.where(own[..., None], np.stack(components, axis=-1), q)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., :1] < 0, -q, q)


def wxyz_rotation(quaternion: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) of unit quaternions (..., 4), w first."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def left_jacobian(vector: np.ndarray) -> np.ndarray:
    """Left Jacobian (3, 3) of a rotation vector (3,): rotation in fixed axes per change of the vector."""
    angle = float(np.linalg.norm(vector))
    skew = skew_matrix(vector)
    if angle < 1e-8:
        return np.eye(3) + skew / 2
    return (
        np.eye(3) + (1 - np.cos(angle)) / angle**2 * skew + (angle - np.sin(angle)) / angle**3 * skew @ skew
    )


def inverse_right_jacobians(vectors: np.ndarray) -> np.ndarray:
    """Inverse right Jacobians (N, 3, 3) of rotation vectors (N, 3): change of the vector with a rotation in the turned axes."""
    angle = np.linalg.norm(vectors, axis=1)
    half = np.maximum(angle, 1e-6) / 2
    factor = np.where(angle < 1e-6, 1 / 12, (1 - half / np.tan(half)) / (4 * half**2))
    skew = np.cross(vectors[:, None, :], np.eye(3)).swapaxes(1, 2)
    return np.eye(3) + skew / 2 + factor[:, None, None] * (skew @ skew)
