"""Sums over the visits of every repeatedly visited command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.error_model.groups import ErrorGroups
from flexcal.calibration.error_model.incidence_matrices import Incidence, incidence, pairs_of


@dataclass(frozen=True, eq=False)
class CommandSums:
    """Sums of K repeatedly visited commands; only commands that share a visit (its targets') have scalar products.

    `once` (G, 3 T) is 1 at the points of the other commands, whose error is each visit's own. `sums` (K, G T) adds rows of a command;
    `cells` (K c, G T T) pairs of rows of a visit, of a command and one of c cells, the `count`; `groups` (k s s, G T T) pairs of rows of
    sets of commands that visits tie together, by their size s: they follow each other.
    """

    once: np.ndarray
    sums: Incidence
    cells: Incidence
    count: int
    groups: tuple[tuple[int, Incidence], ...]

    @classmethod
    def of(cls, points: ErrorGroups, cell: np.ndarray, cells: int) -> CommandSums:
        """Sums of `points` with commands; `cell` (G, T, kinds) are the cells of their visits, -1 where there is no point."""
        assert points.command is not None
        visits = points.visits
        again = np.bincount(points.command[points.command >= 0]) > 1
        number = np.where(again, np.cumsum(again) - 1, -1)
        commanded = (visits >= 0) & (points.command[visits] >= 0)
        command = np.where(commanded, number[points.command[visits]], -1)
        once = np.repeat(commanded & (command < 0), 3, axis=1).astype(float)
        group = _tied(command, int(again.sum()))
        size = np.bincount(group)
        order = np.lexsort([group, size[group]])
        place = np.full(len(group) + 1, -1)
        place[order] = np.arange(len(group))
        command = place[command]
        size = size[group[order]]
        groups, first = [], 0
        for width in np.unique(size):
            last = first + int((size == width).sum())
            own = np.where((command >= first) & (command < last), command - first, -1)[:, :, None]
            pairs = pairs_of(own, np.where(own >= 0, own % width, -1), last - first, int(width))
            groups.append((int(width), pairs))
            first = last
        sums = incidence(command, np.arange(visits.size).reshape(visits.shape), (len(group), visits.size))
        crossed = pairs_of(command[:, :, None], cell, len(group), cells)
        return cls(once, sums, crossed, cells, tuple(groups))

    def crossed(self, entries: np.ndarray) -> np.ndarray:
        """Scalar products (3 K, 3 c) of commands and cells, from the 3 × 3 `entries` (G T T, 9) of all visits' blocks."""
        commands = self.sums.shape[0]
        own = (self.cells @ entries).reshape(commands, self.count, 3, 3)
        return own.transpose(0, 2, 1, 3).reshape(3 * commands, 3 * self.count)

    def blocks(self, entries: np.ndarray) -> tuple[np.ndarray, ...]:
        """Scalar products (k, 3 s, 3 s) of the commands of each size of group."""
        products = []
        for size, pairs in self.groups:
            own = (pairs @ entries).reshape(-1, size, size, 3, 3)
            products.append(own.transpose(0, 1, 3, 2, 4).reshape(-1, 3 * size, 3 * size))
        return tuple(products)

    def entries(self, blocks: Sequence[np.ndarray], crossed: np.ndarray) -> np.ndarray:
        """Entries (G T T, 9) of all visits' blocks from `blocks` and, twice, from `crossed` (3 K, 3 c): the adjoint of both methods."""
        own = crossed.reshape(-1, 3, self.count, 3).transpose(0, 2, 1, 3)
        result = 2 * (self.cells.T @ own.reshape(-1, 9))
        for (size, pairs), values in zip(self.groups, blocks, strict=True):
            own = values.reshape(-1, size, 3, size, 3).transpose(0, 1, 3, 2, 4)
            result += pairs.T @ own.reshape(-1, 9)
        return result

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Errors (G T, 3) of all points from the errors (3 K,) of the commands."""
        return self.placed(values[:, None])

    def placed(self, values: np.ndarray) -> np.ndarray:
        """Rows (G T, 3 k) of all points from the `values` (3 K, k) of the commands."""
        return self.sums.T @ values.reshape(self.sums.shape[0], 3 * values.shape[1])


def _tied(command: np.ndarray, count: int) -> np.ndarray:
    """Group number (count,) of every command; `command` (G, T) are those of the visits, or -1."""
    if not count:
        return np.zeros(0, dtype=int)
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    visit = incidence(command, np.arange(len(command))[:, None], (count, len(command)))
    one = csr_matrix((np.ones(len(visit.rows)), (visit.rows, visit.columns)), shape=visit.shape)
    return connected_components(one @ one.T, directed=False)[1]
