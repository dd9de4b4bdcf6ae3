"""Exact leave-out errors of a linear least-squares fit from its hat matrix."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from flexcal.estimation import mean_distance, principal_variances

_REACH = 1e-2
"""Bound, m, on the root mean square displacement of the points by one column; it affects only directions seen by no other pose."""


@dataclass(frozen=True, eq=False)
class LeaveOutErrors:
    """Leave-out errors of a linear fit of p columns to the residuals of N points.

    `distances` has, for each kind of fold, the distance (N,) m between points and their prediction from the other folds; `squares` (m²) is
    what the fit to all points leaves, a prior's penalty included; `freedom` the trace of the hat matrix, its number of parameters;
    `fitted` (N,) m the distances that it leaves. Where the variances of the readings were given, `expected` has the mean distances (N,) m
    of independent errors with these variances for the kind of fold with the largest `distances`, and `expected_fitted` (N,) those that
    the fit leaves of them.
    """

    distances: tuple[np.ndarray, ...]
    squares: float
    freedom: float
    fitted: np.ndarray
    expected: np.ndarray = field(default_factory=lambda: np.zeros(0))
    expected_fitted: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def of_points(self, count: int) -> LeaveOutErrors:
        """The errors of the first `count` readings."""
        return replace(
            self,
            distances=tuple(d[:count] for d in self.distances),
            fitted=self.fitted[:count],
            expected=self.expected[:count],
            expected_fitted=self.expected_fitted[:count],
        )

    def mean(self, kinds: Sequence[int]) -> float:
        """Mean distance at left-out poses over some kinds of folds, m."""
        return float(np.mean([self.distances[k].mean() for k in kinds]))

    def largest(self, kinds: Sequence[int]) -> float:
        """Largest distance at a left-out pose in some kinds of folds, m."""
        return float(max(self.distances[k].max() for k in kinds))


@dataclass(frozen=True, eq=False)
class LinearBasis:
    """Orthonormal `columns` (3 N + p, p) of a linear fit to `residuals` (N, 3) m, below them the rows of its prior, of `variances` (p,)."""

    residuals: np.ndarray
    columns: np.ndarray
    variances: np.ndarray

    @classmethod
    def of(cls, residuals: np.ndarray) -> LinearBasis:
        """Basis of a fit without columns."""
        return cls(residuals, np.zeros((residuals.size, 0)), np.zeros(0))

    def extended(self, block: np.ndarray, penalty: float) -> LinearBasis:
        """Basis with a further block (N, 3, k) of columns.

        `penalty` is the factor on the sum of squared coefficients of the block, m²: of a prior, with the columns in its standard
        deviations; 0 for none. Projected off the others twice, which is as accurate as reflections (Giraud et al. 2005).
        """
        count, known = block.shape[2], len(self.variances)
        if not count:
            return self
        root = np.sqrt(penalty if penalty > 0 else float(np.mean(self.residuals**2)) / _REACH**2)
        scaled = block if penalty > 0 else block * _scale(block)
        further = np.zeros((len(self.columns) + count, count))
        further[: self.residuals.size] = scaled.reshape(-1, count)
        further[len(self.columns) :] = root * np.eye(count)
        seen = further[: len(self.columns)]
        for _ in range(2 if known else 0):
            seen -= self.columns @ (self.columns.T @ seen)
        columns = np.zeros((len(further), known + count))
        columns[: len(self.columns), :known] = self.columns
        columns[:, known:] = np.linalg.qr(further)[0]
        return LinearBasis(self.residuals, columns, np.append(self.variances, np.full(count, penalty)))

    def left_out(
        self,
        folds: Sequence[np.ndarray],
        places: Sequence[tuple[np.ndarray, np.ndarray]] = (),
        variances: np.ndarray | None = None,
    ) -> LeaveOutErrors:
        """Predict every fold of each kind (N,) from the others.

        With the hat matrix H of the fit to all points and r what it leaves, fold g is off by (1 - H_gg)⁻¹ r_g when it is left out
        (Allen 1974). H_gg = Q_g Q_gᵀ is inverted in the space of its points or of its columns, whichever is smaller.
        `places`: rows (m,) and columns (m, 3, k) by the place of each fixture; one that is left out whole is placed by its own points.
        `variances` (N, 3), m², are those of the residuals' errors, zero where nothing was measured.
        """
        residuals = self.residuals
        seen = self.columns[: residuals.size]
        left = residuals.ravel() - seen @ (seen.T @ residuals.ravel())
        q, r = seen.reshape(len(residuals), 3, -1), left.reshape(-1, 3)
        distances = tuple(_distances(q, r, fold, places) for fold in folds)
        found = LeaveOutErrors(
            distances, float(left @ residuals.ravel()), float((seen**2).sum()), np.linalg.norm(r, axis=1)
        )
        if variances is None:
            return found
        rows = np.concatenate([variances.ravel(), self.variances])
        spread = self.columns.T @ (rows[:, None] * self.columns)
        worst = folds[int(np.argmax([distance.mean() for distance in distances]))]
        expected = _expected_distances(q, variances, spread, worst, places)
        return replace(found, expected=expected, expected_fitted=_expected_residuals(q, variances, spread))


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
    for rows in _folds_by_size(fold):
        q, r = basis[rows].reshape(len(rows), 3 * rows.shape[1], -1), left[rows].reshape(len(rows), -1, 1)
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


def _folds_by_size(fold: np.ndarray) -> Iterator[np.ndarray]:
    """Rows (F, s) of all F folds that have s of them, for every s."""
    number, sizes = np.unique(fold, return_inverse=True, return_counts=True)[1:]
    by_fold, first = np.argsort(number, kind="stable"), np.cumsum(sizes) - sizes
    for size in np.unique(sizes):
        yield by_fold[first[sizes == size, None] + np.arange(size)]


def _expected_residuals(basis: np.ndarray, variances: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Mean distances (N,) that the fit leaves of errors n of diagonal covariance V, `variances` (N, 3): of (1 - H) V (1 - H).

    H = Q Qᵀ with the `basis` Q (N, 3, p), `spread` = Qᵀ V Q (p, p) with the rows of the prior, whose variance is its penalty.
    """
    own = basis @ np.swapaxes(basis, 1, 2) * variances[:, None, :]
    covariance = basis @ spread @ np.swapaxes(basis, 1, 2) - own - np.swapaxes(own, 1, 2)
    return mean_distance(principal_variances(covariance + variances[:, :, None] * np.eye(3)))


def _expected_distances(
    basis: np.ndarray,
    variances: np.ndarray,
    spread: np.ndarray,
    fold: np.ndarray,
    places: Sequence[tuple[np.ndarray, np.ndarray]],
) -> np.ndarray:
    """Mean distances (N,) of points from their prediction without their fold, of errors as in `_expected_residuals`.

    The error of fold g is n_g - Q_g (1 - Q_gᵀ Q_g)⁻¹ Q₋ᵀ n₋, with the others' errors n₋, which are independent of n_g.
    """
    seen, own = basis.copy(), variances[:, :, None] * np.eye(3)
    for rows, columns in places:
        if (fold[rows] == fold[rows[0]]).all():
            flat = columns.reshape(3 * len(rows), -1)
            kept = np.eye(len(flat)) - flat @ np.linalg.pinv(flat, rcond=1e-9)
            seen[rows] = (kept @ seen[rows].reshape(len(flat), -1)).reshape(seen[rows].shape)
            whole = ((kept * variances[rows].ravel()) @ kept).reshape(len(rows), 3, len(rows), 3)
            own[rows] = whole[np.arange(len(rows)), :, np.arange(len(rows))]
    covariance = np.empty_like(own)
    for rows in _folds_by_size(fold):
        folds, size = rows.shape
        q, left = (columns[rows].reshape(folds, 3 * size, -1) for columns in (basis, seen))
        turned, known = q.swapaxes(1, 2), variances[rows].reshape(folds, 3 * size)
        if q.shape[1] <= q.shape[2]:  # (1 - Qᵀ Q)⁻¹ = 1 + Qᵀ (1 - Q Qᵀ)⁻¹ Q
            left = left + left @ turned @ np.linalg.solve(np.eye(q.shape[1]) - q @ turned, q)
            itself = left @ turned
            whole = left @ spread @ left.swapaxes(1, 2) - (itself * known[:, None]) @ itself.swapaxes(1, 2)
            each = np.arange(size)
            covariance[rows.T] = whole.reshape(folds, size, 3, size, 3)[:, each, :, each]
        else:
            others = (spread - turned @ (known[..., None] * q))[:, None]
            left = left @ np.linalg.inv(np.eye(q.shape[2]) - turned @ q)
            left = left.reshape(folds, size, 3, -1)
            covariance[rows] = left @ others @ left.swapaxes(2, 3)
    return mean_distance(principal_variances(covariance + own))
