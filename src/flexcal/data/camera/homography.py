"""Start of a camera calibration from views of a plane (Zhang 2000)."""

from __future__ import annotations

import numpy as np

_TYPICAL = 1.2
"""Focal length relative to the larger side of the image, where the views do not tell it."""
_LIKELY = (0.3, 10.0)
"""Bounds of the focal length relative to the larger side of the image."""


def homography(plane: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Homography (3, 3) from points in a plane (N, 2) to pixels (N, 2), N at least 4, by the normalised direct linear transformation."""
    to_plane, to_pixels = _normalised(plane), _normalised(pixels)
    source = np.column_stack([plane, np.ones(len(plane))]) @ to_plane.T
    target = np.column_stack([pixels, np.ones(len(pixels))]) @ to_pixels.T
    rows = np.zeros((2 * len(plane), 9))
    rows[::2, :3], rows[::2, 6:] = source, -target[:, :1] * source
    rows[1::2, 3:6], rows[1::2, 6:] = source, -target[:, 1:2] * source
    solution = np.linalg.svd(rows)[2][-1].reshape(3, 3)
    return np.linalg.solve(to_pixels, solution @ to_plane)


def first_lens(homographies: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Focal length and principal point as `LENS` without distortion, from homographies (V, 3, 3) of an image of `size` (2,) pixels.

    The principal point is the centre of the image, and both focal lengths are equal; where the views do not tell it, a typical one.
    """
    centre, side = size / 2, float(size.max())
    to_centre = np.array([[1, 0, -centre[0]], [0, 1, -centre[1]], [0, 0, side]]) / side
    shifted = to_centre @ homographies
    a, b = shifted[:, :, 0], shifted[:, :, 1]
    # a and b are images of two perpendicular vectors of equal length: linear in 1/f²
    planar = np.concatenate(
        [a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1], (a[:, :2] ** 2).sum(1) - (b[:, :2] ** 2).sum(1)]
    )
    axial = np.concatenate([a[:, 2] * b[:, 2], a[:, 2] ** 2 - b[:, 2] ** 2])
    scale = np.tile(np.linalg.norm(a, axis=1) ** 2, 2)
    planar, axial = planar / scale, axial / scale
    inverse_square = -float(planar @ axial) / max(float(planar @ planar), 1e-300)
    focal = 1 / np.sqrt(inverse_square) if inverse_square > 0 else np.nan
    if not _LIKELY[0] < focal < _LIKELY[1]:
        focal = _TYPICAL
    return np.array([focal * side, focal * side, *centre, 0, 0, 0, 0, 0])


def plane_pose(matrix: np.ndarray, lens: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and translation (3,) of a plane before the camera, from its homography (3, 3) and the lens without distortion."""
    camera = np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1.0]])
    columns = np.linalg.solve(camera, matrix)
    columns = columns / np.sqrt(np.linalg.norm(columns[:, 0]) * np.linalg.norm(columns[:, 1]))
    if columns[2, 2] < 0:
        columns = -columns
    axes = np.column_stack([columns[:, 0], columns[:, 1], np.cross(columns[:, 0], columns[:, 1])])
    left, _, right = np.linalg.svd(axes)
    return left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right, columns[:, 2]


def _normalised(points: np.ndarray) -> np.ndarray:
    """Similarity (3, 3) that moves points (N, 2) to their mean with a root mean square distance of √2 (Hartley 1997)."""
    mean = points.mean(axis=0)
    scale = np.sqrt(2) / max(float(np.sqrt(np.mean(np.sum((points - mean) ** 2, axis=1)))), 1e-300)
    return np.array([[scale, 0, -scale * mean[0]], [0, scale, -scale * mean[1]], [0, 0, 1]])
