"""Unit quaternions (w, x, y, z), as viser wants rotations."""

from __future__ import annotations

import numpy as np


def quaternions(rotations: np.ndarray) -> np.ndarray:
    """Unit quaternions (N, 4), w first and not negative, of rotations (N, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_matrix(rotations).as_quat(canonical=True), 1, axis=1)


def towards(directions: np.ndarray) -> np.ndarray:
    """Unit quaternions (N, 4) that turn the z axis to unit vectors `directions` (N, 3)."""
    x, y, z = directions.T
    w = 1.0 + z
    turns = np.stack([w, -y, x, np.zeros_like(w)], axis=1)
    turns[w < 1e-9] = (0.0, 1.0, 0.0, 0.0)
    return turns / np.linalg.norm(turns, axis=1)[:, None]
