"""Triangle meshes of simple bodies, for drawing: vertices (V, 3) m and triangles (F, 3) of vertex numbers."""

from __future__ import annotations

import numpy as np

_AROUND = 20
"""Number of corners of a circle."""
_RINGS = 4
"""Number of rings of a hemisphere."""


def box(half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Box about the origin; `half` (3,) are half its sides."""
    corners = ((np.arange(8)[:, None] >> np.arange(3)) & 1) * 2.0 - 1.0
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return corners * half, np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])


def capsule(radius: float, half_length: float) -> tuple[np.ndarray, np.ndarray]:
    """Capsule about the z axis: a cylinder from −`half_length` to `half_length` with a hemisphere at either end."""
    angle = np.linspace(0, np.pi / 2, _RINGS + 1)
    rings = radius * np.cos(angle), radius * np.sin(angle) + half_length
    return _revolved(np.r_[rings[0][::-1], rings[0]], np.r_[-rings[1][::-1], rings[1]])


def cylinder(radius: float, half_length: float) -> tuple[np.ndarray, np.ndarray]:
    """Cylinder about the z axis with its ends."""
    height = np.array([-half_length, -half_length, half_length, half_length])
    return _revolved(radius * np.array([0.0, 1.0, 1.0, 0.0]), height)


def ellipsoid(half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ellipsoid about the origin with half axes `half` (3,)."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 2 * _RINGS + 1)
    vertices, triangles = _revolved(np.cos(angle), np.sin(angle))
    return vertices * half, triangles


def decimated(vertices: np.ndarray, triangles: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Mesh reduced to at most `most` triangles by merging vertices in the cells of a grid, which is coarsened until few enough remain."""
    cell = float(np.ptp(vertices, axis=0).max()) / 256
    while len(triangles) > most:
        cells = np.floor((vertices - vertices.min(axis=0)) / cell).astype(int)
        _, group, count = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
        merged = np.zeros((len(count), 3))
        np.add.at(merged, group.ravel(), vertices)
        renamed = np.unique(np.sort(group.ravel()[triangles], axis=1), axis=0)
        solid = (np.diff(renamed, axis=1) > 0).all(axis=1)
        vertices, triangles = merged / count[:, None], renamed[solid]
        cell *= 1.3
    return vertices, triangles


def _revolved(radius: np.ndarray, height: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Surface of revolution about z through the points (radius, height) of its outline."""
    turn = 2 * np.pi * np.arange(_AROUND) / _AROUND
    x, y = radius[:, None] * np.cos(turn), radius[:, None] * np.sin(turn)
    vertices = np.stack([x, y, np.broadcast_to(height[:, None], x.shape)], axis=-1).reshape(-1, 3)
    ring = np.arange(len(radius) - 1)[:, None] * _AROUND
    here, beside = ring + np.arange(_AROUND), ring + (np.arange(_AROUND) + 1) % _AROUND
    lower = np.stack([here, beside, beside + _AROUND], axis=-1)
    upper = np.stack([here, beside + _AROUND, here + _AROUND], axis=-1)
    return vertices, np.concatenate([lower, upper]).reshape(-1, 3)
