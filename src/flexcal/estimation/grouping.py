"""Groups of residual rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError


@dataclass(frozen=True, eq=False)
class Grouping:
    """`labels` (G,) in ascending order, the group `number` (m,) of every row, the `sizes` (G,)."""

    labels: np.ndarray
    number: np.ndarray
    sizes: np.ndarray

    @classmethod
    def of(cls, groups: np.ndarray | None, rows: int) -> Grouping:
        """From labels (m,), or one group a row; raises FlexcalError when the labels do not fit the m rows."""
        if groups is None:
            each = np.arange(rows)
            return cls(each, each, np.ones(rows, dtype=int))
        groups = np.asarray(groups)
        if groups.shape != (rows,) or not np.issubdtype(groups.dtype, np.integer):
            raise FlexcalError(
                f"groups must hold one integer for each of the {rows} residual rows, "
                f"not an array of shape {groups.shape} and type {groups.dtype}."
            )
        labels, number, sizes = np.unique(groups, return_inverse=True, return_counts=True)
        return cls(labels, number, sizes)

    def norms(self, residual: np.ndarray) -> np.ndarray:
        """Euclidean norm (G,) of the residual (m,) in each group."""
        if self.labels.size == residual.size:
            return np.abs(residual)[np.argsort(self.number)]
        return np.sqrt(np.bincount(self.number, residual**2, self.labels.size))

    def sums(self, rows: np.ndarray) -> np.ndarray:
        """Sum (G, p) of the rows (m, p) in each group."""
        order = np.argsort(self.number, kind="stable")
        starts = np.concatenate([[0], np.cumsum(self.sizes)[:-1]])
        return np.add.reduceat(rows[order], starts, axis=0)
