"""Sparse matrices that add rows, or pairs of rows, of the visits to poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.kernels import add_selected


@dataclass(frozen=True, eq=False)
class Incidence:
    """Sparse matrix of ones, of a `shape`, at `rows` (E,) and `columns` (E,)."""

    rows: np.ndarray
    columns: np.ndarray
    shape: tuple[int, int]

    @property
    def T(self) -> Incidence:
        """The transpose."""
        return Incidence(self.columns, self.rows, (self.shape[1], self.shape[0]))

    def __matmul__(self, values: np.ndarray) -> np.ndarray:
        """Sums (shape[0], k) of rows of `values` (shape[1], k)."""
        result = np.zeros((self.shape[0], values.shape[1]))
        add_selected(self.rows, self.columns, values, result)
        return result


def incidence(labels: np.ndarray, columns: np.ndarray, shape: tuple[int, int]) -> Incidence:
    """Sparse matrix of ones at rows `labels` and columns `columns`, of broadcastable shapes; none where a label is negative."""
    labels, columns = np.broadcast_arrays(labels, columns)
    known = labels >= 0
    return Incidence(labels[known], columns[known], shape)


def pairs_of(first: np.ndarray, second: np.ndarray, rows: int, columns: int) -> Incidence:
    """Incidence matrix (rows columns, G T T) of pairs of rows of a visit, one label (G, T, kinds) out of `first` and one out of `second`.

    Negative labels are of no row.
    """
    visits, places = first.shape[:2]
    one, other = first[:, :, None, :, None], second[:, None, :, None, :]
    label = np.where((one >= 0) & (other >= 0), one * columns + other, -1)
    entry = np.arange(visits * places**2).reshape(visits, places, places, 1, 1)
    return incidence(label, entry, (rows * columns, visits * places**2))


def by_axes(inner: np.ndarray) -> np.ndarray:
    """Entries (G T T, 9) of the 3 × 3 submatrices of blocks (G, 3 T, 3 T)."""
    places = inner.shape[1] // 3
    return inner.reshape(-1, places, 3, places, 3).transpose(0, 1, 3, 2, 4).reshape(-1, 9)


def by_visits(entries: np.ndarray, places: int) -> np.ndarray:
    """Blocks (G, 3 T, 3 T) of T `places` from the entries (G T T, 9) of their 3 × 3 submatrices."""
    blocks = entries.reshape(-1, places, places, 3, 3).transpose(0, 1, 3, 2, 4)
    return blocks.reshape(-1, 3 * places, 3 * places)


def added(sums: Incidence, rows: np.ndarray) -> np.ndarray:
    """Sums (3 K, k) of `rows` (G, 3 T, k) over K blocks."""
    width = rows.shape[2]
    return (sums @ rows.reshape(-1, 3 * width)).reshape(-1, width)
