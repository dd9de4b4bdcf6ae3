"""Upper-triangular factor of a tall least-squares system, updated block by block."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from flexcal.kernels import update

_TOLERANCE = 1e-9
"""Singular value of columns of comparable size below which it is zero."""


@dataclass(frozen=True, eq=False)
class TriangularFactor:
    """R (k + 1, k + 1) of the QR of [W, Y], W (rows, k) and Y (rows,), sufficient for least squares.

    Triangles of the same columns add up: R of two systems is R of their R stacked. No product WᵀW is ever formed.
    """

    factor: np.ndarray
    rows: int

    @classmethod
    def of(cls, matrix: np.ndarray, right: np.ndarray) -> TriangularFactor:
        """Factor of W (rows, k) and Y (rows,)."""
        return cls(triangular(np.column_stack([matrix, right])), len(right))

    @classmethod
    def padded(cls, factor: np.ndarray, rows: int) -> TriangularFactor:
        """Factor from a matrix (·, k + 1) of at most k + 1 rows, which represents `rows` rows."""
        size = factor.shape[1]
        return cls(np.vstack([factor, np.zeros((size - len(factor), size))]), rows)

    @classmethod
    def empty(cls, columns: int) -> TriangularFactor:
        """Factor of no rows."""
        return cls(np.zeros((columns + 1, columns + 1)), 0)

    def __add__(self, other: TriangularFactor) -> TriangularFactor:
        return TriangularFactor(triangular(np.vstack([self.factor, other.factor])), self.rows + other.rows)

    @property
    def matrix(self) -> np.ndarray:
        """Matrix (k + 1, k) in place of W."""
        return self.factor[:, :-1]

    @property
    def right(self) -> np.ndarray:
        """Vector (k + 1,) in place of Y."""
        return self.factor[:, -1]

    def residual(self, parameters: np.ndarray) -> float:
        """Norm of the residual, ‖Y − W · parameters‖, for `parameters` (k,)."""
        return float(np.linalg.norm(self.right - self.matrix @ parameters))

    def part(self, columns: np.ndarray) -> TriangularFactor:
        """Factor for the numbered `columns` of W alone."""
        return TriangularFactor(self.factor[:, [*columns, -1]], self.rows)

    def noise(self, scale: np.ndarray | None = None) -> tuple[float, int]:
        """Noise σ̂ of Eq. 2.28 of this system alone, and its rank; NaN without more rows than that.

        `scale` (k,) makes the columns compare; without it each gets unit length.
        """
        if scale is None:
            norms = np.linalg.norm(self.matrix, axis=0)
            scale = 1.0 / np.where(norms > 0, norms, 1.0)
        directions, sizes, _ = np.linalg.svd(self.matrix * scale, full_matrices=False)
        seen = directions[:, sizes > _TOLERANCE]
        rank = seen.shape[1]
        left = self.right - seen @ (seen.T @ self.right)
        freedom = self.rows - rank
        return (float(np.linalg.norm(left) / np.sqrt(freedom)) if freedom > 0 else np.nan), rank


def stacked(
    triangles: Iterable[TriangularFactor], column_indices: Iterable[np.ndarray], columns: int
) -> TriangularFactor:
    """Factor for all `columns` from factors of their `column_indices` each."""
    total = TriangularFactor.empty(columns)
    for triangle, numbers in zip(triangles, column_indices, strict=True):
        total = total + TriangularFactor(widened(triangle.factor, numbers, columns), triangle.rows)
    return total


def widened(system: np.ndarray, column_indices: np.ndarray, columns: int) -> np.ndarray:
    """System [W, Y] (·, columns + 1) of all `columns` from a system (·, k + 1) of its `column_indices`."""
    wide = np.zeros((len(system), columns + 1))
    wide[:, column_indices] = system[:, :-1]
    wide[:, -1] = system[:, -1]
    return wide


def triangular(matrix: np.ndarray) -> np.ndarray:
    """Triangular factor R (k, k) of a matrix (·, k), by Householder reflections; the last rows are zero, to rounding, if it has fewer."""
    factor = np.zeros((matrix.shape[1], matrix.shape[1]))
    update(factor, matrix.T)
    return factor
