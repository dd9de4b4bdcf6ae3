"""Poses from a recording: mean joint positions and measured points at standstill."""

from __future__ import annotations

import numpy as np

STILL = 1e-3
"""Range (rad or m) within which a joint stands still."""
LONG_ENOUGH = 0.5
"""Shortest standstill, s: half of it at either end is left out for decaying vibration."""
ENOUGH_READINGS = 5
"""Number of readings of a point in every pose from which their scatter is its standard deviation."""


def standstills(t: np.ndarray, q: np.ndarray) -> list[tuple[int, int]]:
    """First and last sample (from 0) of every standstill in joint positions `q` (N, n) at times `t` (N,), s, in their order.

    The ends are half of `LONG_ENOUGH` inside it.
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    if len(t) < 2 or t[-1] - t[0] < LONG_ENOUGH:
        return []
    step = float(np.median(np.diff(t)))
    size = max(2, round(LONG_ENOUGH / step)) | 1
    travel = (maximum_filter1d(q, size, axis=0) - minimum_filter1d(q, size, axis=0)).max(axis=1)
    inside = np.arange(len(t))
    still = (travel < STILL) & (inside >= size // 2) & (inside < len(t) - size // 2)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    runs = [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [(a, b) for a, b in runs if np.ptp(q[a : b + 1], axis=0).max() < 2 * STILL]


def points_at_rest(
    t: np.ndarray, q: np.ndarray, point_time: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float | None, int]:
    """Joint positions (P, n) and points (P, 3) in the standstills with a point, the scatter of the points, and how many had none.

    `points` (M, 3), m, were measured at `point_time` (M,), s, of the same clock as `t`. Both are averaged over a standstill; the scatter
    is the standard deviation of a coordinate of a single reading, of all poses together, at least a micrometre; None where a pose has
    too few readings.
    """
    means, places, squares, readings, without = [], [], 0.0, [], 0
    for first, last in standstills(t, q):
        during = (point_time >= t[first]) & (point_time <= t[last])
        if not during.any():
            without += 1
            continue
        means.append(q[first : last + 1].mean(axis=0))
        places.append(points[during].mean(axis=0))
        readings.append(int(during.sum()))
        squares += float(((points[during] - places[-1]) ** 2).sum())
    enough = bool(readings) and min(readings) >= ENOUGH_READINGS
    sigma = max(1e-6, np.sqrt(squares / (3 * (sum(readings) - len(readings))))) if enough else None
    return np.array(means), np.array(places), sigma, without
