"""Folds for cross-validation of correlated poses: contiguous in measuring order, or in the workspace."""

from __future__ import annotations

import numpy as np

_SAME = 0.01
"""Difference of joint positions, rad or m, below which poses are the same."""
_PAIRS = 1_000_000
"""Number of pairs of rows that are compared all at once."""


def repeated_pose_numbers(q: np.ndarray) -> np.ndarray:
    """Number (N,) of the pose that each row of joint positions `q` (N, n) repeats: those that differ by less than 0.01 rad or m are one."""
    result = np.full(len(q), -1)
    if not len(q):
        return result
    # only those within 0.01 in the coordinate that varies most may be the same
    along = q[:, np.argmax(np.ptp(q, axis=0))]
    order = np.argsort(along)
    reach = 1.001 * _SAME  # wider by more than rounding
    first = np.searchsorted(along[order], along - reach)
    last = np.searchsorted(along[order], along + reach)
    if (last - first).sum() <= _PAIRS:
        row, place = np.repeat(np.arange(len(q)), last - first), np.arange((last - first).sum())
        close = order[place - np.repeat(np.cumsum(last - first) - last, last - first)]
        near = np.abs(q[close] - q[row]).max(axis=1) < _SAME
        alone = np.bincount(row[near], minlength=len(q)) == 1
        result[alone] = np.flatnonzero(alone)
    for row in np.flatnonzero(result < 0):
        if result[row] < 0:
            close = order[first[row] : last[row]]
            near = (np.abs(q[close] - q[row]).max(axis=1) < _SAME) & (result[close] < 0)
            result[close[near]] = row
    return np.unique(result, return_inverse=True)[1]


def are_different(q: np.ndarray, count: int) -> bool:
    """Whether joint positions (N, n) include at least `count` different poses, as counted by `repeated_pose_numbers`."""
    for _ in range(count):
        if not len(q):
            return False
        q = q[np.abs(q - q[0]).max(axis=1) >= _SAME]
    return True


def order_folds(samples: int, folds: int) -> np.ndarray:
    """Fold number (samples,) of consecutive blocks of nearly equal size."""
    return (np.arange(samples) * folds) // samples


def workspace_folds(points: np.ndarray, folds: int) -> np.ndarray:
    """Fold number (N,) of workspace cells of nearly equal count: `points` (N, 3) are recursively halved across their longest direction."""
    result = np.zeros(len(points), dtype=int)
    cells = [np.arange(len(points))]
    while len(cells) < folds:
        largest = max(range(len(cells)), key=lambda k: len(cells[k]))
        cell = cells.pop(largest)
        centred = points[cell] - points[cell].mean(axis=0)
        direction = np.linalg.svd(centred, full_matrices=False)[2][0]
        order = cell[np.argsort(centred @ direction, kind="stable")]
        cells += [order[: len(order) // 2], order[len(order) // 2 :]]
    for k, cell in enumerate(cells):
        result[cell] = k
    return result
