"""Rotations: unit quaternions (w, x, y, z), as viser wants them, and frames about directions."""

from __future__ import annotations

import numpy as np


def quaternions(rotations: np.ndarray) -> np.ndarray:
    """Unit quaternions (N, 4), w first and not negative, of rotations (N, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_matrix(rotations).as_quat(canonical=True), 1, axis=1)


def across(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors x and y (N, 3) that make a right-handed frame with z along `directions` (N, 3); any frame where these are zero."""
    length = np.linalg.norm(directions, axis=1)[:, None]
    z = np.divide(directions, length, out=np.tile([0.0, 0.0, 1.0], (len(directions), 1)), where=length > 0)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z), axis=1)], z)
    x /= np.linalg.norm(x, axis=1)[:, None]
    return x, np.cross(z, x)
