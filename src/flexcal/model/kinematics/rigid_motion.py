"""Motion of points that move as one body."""

from __future__ import annotations

import numpy as np


def rigid_motion_columns(points: np.ndarray) -> np.ndarray:
    """Derivatives (N, 3, 6) of points (N, 3), m, by a translation, m, and a small rotation, rad, of all of them about the origin."""
    columns = np.zeros((len(points), 3, 6))
    columns[:, :, :3] = np.eye(3)
    columns[:, :, 3:] = np.cross(np.eye(3)[:, None], points).transpose(1, 2, 0)
    return columns
