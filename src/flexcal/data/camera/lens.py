"""Projection of points by a camera: pinhole with radial and tangential distortion (Brown 1966, as in OpenCV)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.model.robot import LENS


def projected(points: np.ndarray, lens: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixels of points in the camera's frame, z along the optical axis, x to the right, y downwards.

    Parameters
    ----------
    points : ndarray
        Points (N, 3), m.
    lens : ndarray
        Intrinsic parameters (9,) in the order of `LENS`.

    Returns
    -------
    pixels : ndarray
        Pixels u, v (N, 2).
    by_point : ndarray
        Their derivatives by the points (N, 2, 3), 1/m.
    by_lens : ndarray
        Their derivatives by the intrinsic parameters (N, 2, 9).
    """
    focal, centre, (k1, k2, p1, p2, k3) = lens[:2], lens[2:4], lens[4:]
    depth = points[:, 2]
    x, y = points[:, 0] / depth, points[:, 1] / depth
    square = x * x + y * y
    radial = 1 + square * (k1 + square * (k2 + square * k3))
    slope = k1 + square * (2 * k2 + 3 * square * k3)
    bent = np.column_stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x),
            y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y,
        ]
    )
    by_plane = np.empty((len(points), 2, 2))
    by_plane[:, 0, 0] = radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x
    by_plane[:, 0, 1] = by_plane[:, 1, 0] = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y
    by_plane[:, 1, 1] = radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x
    by_direction = np.zeros((len(points), 2, 3))
    by_direction[:, 0, 0] = by_direction[:, 1, 1] = 1 / depth
    by_direction[:, 0, 2], by_direction[:, 1, 2] = -x / depth, -y / depth
    by_lens = np.zeros((len(points), 2, len(LENS)))
    by_lens[:, 0, 0], by_lens[:, 1, 1] = bent[:, 0], bent[:, 1]
    by_lens[:, 0, 2] = by_lens[:, 1, 3] = 1
    powers = np.stack([square, square**2, 2 * x * y, square + 2 * x * x, square**3], axis=1)
    by_lens[:, 0, 4:] = np.stack(
        [x * powers[:, 0], x * powers[:, 1], powers[:, 2], powers[:, 3], x * powers[:, 4]], 1
    )
    by_lens[:, 1, 4:] = np.stack(
        [y * powers[:, 0], y * powers[:, 1], square + 2 * y * y, powers[:, 2], y * powers[:, 4]], 1
    )
    by_lens[:, :, 4:] *= focal[:, None]
    return focal * bent + centre, (focal[:, None] * by_plane) @ by_direction, by_lens


@dataclass(frozen=True, eq=False)
class Lens:
    """Intrinsic parameters of a camera, `values` (9,) in the order of `LENS`, with their `covariance` (9, 9)."""

    values: np.ndarray
    covariance: np.ndarray
