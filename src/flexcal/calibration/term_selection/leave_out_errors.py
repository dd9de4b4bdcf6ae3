"""Exact leave-out errors of a linear least-squares fit from its hat matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_REACH = 1e-2
"""Bound, m, on the root mean square displacement of the points by one column; it affects only directions seen by no other pose."""


@dataclass(frozen=True, eq=False)
class LeaveOutErrors:
    """Leave-out errors of a linear fit of p columns to the residuals of N points.

    `distances` has, for each kind of fold, the distance (N,) m between points and their prediction from the other folds; `squares` (m²) is
    what the fit to all points leaves, a prior's penalty included; `freedom` the trace of the hat matrix, its number of parameters.
    """

    distances: tuple[np.ndarray, ...]
    squares: float
    freedom: float

    def mean(self, kinds: Sequence[int]) -> float:
        """Mean distance at left-out poses over some kinds of folds, m."""
        return float(np.mean([self.distances[k].mean() for k in kinds]))

    def largest(self, kinds: Sequence[int]) -> float:
        """Largest distance at a left-out pose in some kinds of folds, m."""
        return float(max(self.distances[k].max() for k in kinds))


def leave_out_fit(
    columns: Sequence[np.ndarray],
    penalty: Sequence[float],
    residuals: np.ndarray,
    folds: Sequence[np.ndarray],
    places: Sequence[tuple[np.ndarray, np.ndarray]] = (),
) -> LeaveOutErrors:
    """Fit blocks of `columns` (N, 3, k) to `residuals` (N, 3) m, and predict every fold of each kind (N,) from the others.

    With the hat matrix H of the fit to all points and r what it leaves, fold g is off by (1 - H_gg)⁻¹ r_g when it is left out
    (Allen 1974). `penalty` is the factor on the sum of squared coefficients of each block, m²: of a prior, with the columns in its
    standard deviations; 0 for none. H_gg = Q_g Q_gᵀ is inverted in the space of its points or of its columns, whichever is smaller.
    `places`: rows (m,) and columns (m, 3, k) by the place of each fixture; one that is left out whole is placed by its own points.
    """
    scaled = [
        block * _scale(block) if free == 0 else block for block, free in zip(columns, penalty, strict=True)
    ]
    stacked = np.concatenate(scaled, axis=2).reshape(residuals.size, -1)
    variance = float(np.mean(residuals**2))
    roots = [
        np.full(block.shape[2], np.sqrt(factor if factor > 0 else variance / _REACH**2))
        for block, factor in zip(columns, penalty, strict=True)
    ]
    basis, _ = np.linalg.qr(np.concatenate([stacked, np.diag(np.concatenate(roots))]))
    seen = basis[: residuals.size]
    left = residuals.ravel() - seen @ (seen.T @ residuals.ravel())
    q, r = seen.reshape(len(residuals), 3, -1), left.reshape(-1, 3)
    distances = tuple(_distances(q, r, fold, places) for fold in folds)
    return LeaveOutErrors(distances, float(left @ residuals.ravel()), float((seen**2).sum()))


def _scale(block: np.ndarray) -> np.ndarray:
    """Factors (k,) that normalise the displacement of the points by each column to 1 in root mean square; 0 for zero columns."""
    size = np.sqrt((block**2).sum(axis=1).mean(axis=0))
    return np.divide(1.0, size, out=np.zeros_like(size), where=size > 0)


def _distances(
    basis: np.ndarray,
    left: np.ndarray,
    fold: np.ndarray,
    places: Sequence[tuple[np.ndarray, np.ndarray]],
) -> np.ndarray:
    """Distances (N,) of the points, of which the fit to all leaves `left` (N, 3), from their prediction without their fold (N,)."""
    errors = np.empty_like(left)
    number, sizes = np.unique(fold, return_inverse=True, return_counts=True)[1:]
    by_fold, first = np.argsort(number, kind="stable"), np.cumsum(sizes) - sizes
    for size in np.unique(sizes):
        rows = by_fold[first[sizes == size, None] + np.arange(size)]  # of all folds of this size
        q, r = basis[rows].reshape(len(rows), 3 * size, -1), left[rows].reshape(len(rows), 3 * size, 1)
        turned = q.swapaxes(1, 2)
        if q.shape[1] <= q.shape[2]:
            error = np.linalg.solve(np.eye(q.shape[1]) - q @ turned, r)
        else:
            error = r + q @ np.linalg.solve(np.eye(q.shape[2]) - turned @ q, turned @ r)
        errors[rows] = error.reshape(*rows.shape, 3)
    for rows, columns in places:
        if (fold[rows] == fold[rows[0]]).all():
            flat = columns.reshape(3 * len(rows), -1)
            shift = flat @ np.linalg.lstsq(flat, errors[rows].ravel(), rcond=1e-9)[0]
            errors[rows] -= shift.reshape(-1, 3)
    return np.linalg.norm(errors, axis=1)
