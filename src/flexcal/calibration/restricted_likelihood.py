"""Restricted likelihood of variance components of measured points, from sums over visits to poses and over blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.scatter import Scatter

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from flexcal.calibration.variance_components import LinearFit


@dataclass(frozen=True, eq=False)
class PointSums:
    """Columns of a linear fit by visits to poses, and the sums that make scalar products of the columns that blocks share.

    `columns` (G, 3 T, p + w + 1) are those of the fit, w waves of transmission errors and, the last, its residual; `structures` are
    ∂V/∂variance of the components that visits have on their own, (G, 3 T, 3 T) or as diagonals (G, 3 T); `blocks` says which of K blocks
    are a component's; `sums` (K, G T) and `pairs` (K K, G T T) add rows, and pairs of rows of one visit, that belong to a block, and to a
    pair of blocks.
    """

    fit: LinearFit
    columns: np.ndarray
    structures: dict[str, np.ndarray]
    blocks: dict[str, np.ndarray]
    sums: csr_matrix
    pairs: csr_matrix

    @classmethod
    def of(cls, fit: LinearFit) -> PointSums:
        from scipy.sparse import csr_matrix

        cells = fit.cells
        columns = cells.gathered(
            np.concatenate([fit.free, fit.tied, fit.waves, fit.residual[:, :, None]], axis=2)
        )
        turned = cells.gathered(fit.turns)
        structures = {
            "robot": cells.gathered(np.ones(fit.residual.shape)),
            "share": cells.gathered(fit.sigma**2),
            "pose": cells.common,
            "angular": turned @ np.swapaxes(turned, 1, 2),
        }
        blocks, labels, count = {}, [], 0
        for name, own in cells.blocks.items():
            size = int(own.max()) + 1
            blocks[name] = np.arange(count, count + size)
            labels.append(own + count)
            count += size
        there = cells.visits >= 0
        label = (
            np.array(labels, dtype=int).reshape(len(labels), len(cells.pose)).T[cells.visits]
        )  # (G, T, kinds)
        visits, places, kinds = label.shape
        row = np.arange(visits * places).reshape(visits, places, 1)
        known = np.broadcast_to(there[:, :, None], label.shape)
        cell = np.broadcast_to(row, label.shape)[known]
        sums = csr_matrix((np.ones(known.sum()), (label[known], cell)), shape=(count, visits * places))
        shape = (visits, places, places, kinds, kinds)
        both = np.broadcast_to((there[:, :, None] & there[:, None])[..., None, None], shape)
        pair = np.broadcast_to(label[:, :, None, :, None] * count + label[:, None, :, None, :], shape)[both]
        entry = np.arange(visits * places**2).reshape(visits, places, places, 1, 1)
        entry = np.broadcast_to(entry, shape)[both]
        pairs = csr_matrix((np.ones(both.sum()), (pair, entry)), shape=(count**2, visits * places**2))
        return cls(fit, columns, structures, blocks, sums, pairs)

    def gram(self, inner: np.ndarray) -> np.ndarray:
        """CᵀQC of all columns C, those of the blocks (three each, 1 where a point belongs to it) the last, with Q by its blocks `inner`."""
        size, count = self.columns.shape[2], self.count
        moved = np.matmul(inner, self.columns)
        result = np.empty((size + 3 * count, size + 3 * count))
        result[:size, :size] = self.columns.reshape(-1, size).T @ moved.reshape(-1, size)
        if count:
            result[size:, :size] = self.block_sums(moved)
            result[:size, size:] = result[size:, :size].T
            places = inner.shape[1] // 3
            entries = inner.reshape(-1, places, 3, places, 3).transpose(0, 1, 3, 2, 4).reshape(-1, 9)
            own = (self.pairs @ entries).reshape(count, count, 3, 3)
            result[size:, size:] = own.transpose(0, 2, 1, 3).reshape(3 * count, 3 * count)
        return result

    @property
    def count(self) -> int:
        """Number of blocks."""
        return sum(len(own) for own in self.blocks.values())

    def block_sums(self, rows: np.ndarray) -> np.ndarray:
        """Sums of `rows` (G, 3 T, k) over each block, (3 K, k)."""
        width = rows.shape[2]
        return (self.sums @ rows.reshape(-1, 3 * width)).reshape(-1, width)

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Errors (G, 3 T) of all points from those (3 K,) of each block."""
        return (self.sums.T @ values.reshape(-1, 3)).reshape(len(self.columns), -1)

    def index(self, name: str) -> np.ndarray:
        """Numbers of the columns of a component: of its blocks, or of the waves."""
        if name not in self.blocks:
            last = self.columns.shape[2] - 1
            return np.arange(last - self.fit.waves.shape[2], last)
        first = self.columns.shape[2] + 3 * self.blocks[name]
        return (first[:, None] + np.arange(3)).ravel()


@dataclass(frozen=True, eq=False)
class RestrictedLikelihood:
    """Restricted likelihood at some components: with P = V⁻¹ - V⁻¹X(XᵀV⁻¹X)⁻¹XᵀV⁻¹ of the parameters X, the shared errors being in V.

    `inverse` (G, 3 T, 3 T) is that of the visits' own covariance; `used` are the columns of X, of what is known of them beforehand and of
    the blocks, `sizes` their standard deviations (1 for X); `lower` L with L Lᵀ = S Cᵀ V₀⁻¹ C S + (0 for X, else 1).
    """

    sums: PointSums
    names: tuple[str, ...]
    inverse: np.ndarray
    gram: np.ndarray
    used: np.ndarray
    sizes: np.ndarray
    lower: np.ndarray
    solution: np.ndarray
    deviance: float

    @classmethod
    def of(cls, sums: PointSums, names: Sequence[str], scatter: Scatter) -> RestrictedLikelihood:
        """At a scatter, to be derived by the variances of the components `names`."""
        from scipy.linalg import solve_triangular

        fit = sums.fit
        factor = np.linalg.cholesky(scatter.jointly(fit.sigma, fit.turns, fit.cells))
        whitening = np.linalg.inv(factor)
        inverse = np.swapaxes(whitening, 1, 2) @ whitening
        gram = sums.gram(inverse)
        last = sums.columns.shape[2] - 1
        fixed = np.arange(last - fit.waves.shape[2])
        shared = {name: sums.index(name) for name in names if name not in sums.structures}
        used = np.concatenate([fixed, *shared.values()])
        stds = [np.full(len(own), getattr(scatter, name)) for name, own in shared.items()]
        sizes = np.concatenate([np.ones(len(fixed)), *stds])
        normal = gram[np.ix_(used, used)] * sizes * sizes[:, None]
        known = np.arange(fit.free.shape[2], len(used))
        normal[known, known] += 1.0
        lower = np.linalg.cholesky(normal)
        half = solve_triangular(lower, sizes * gram[used, last], lower=True)
        solution = np.zeros(len(gram))
        solution[used] = -sizes * solve_triangular(lower.T, half)
        solution[last] = 1.0
        deviance = 2 * float(np.log(np.diagonal(factor, axis1=1, axis2=2)).sum())
        deviance += 2 * float(np.log(np.diag(lower)).sum()) + float(gram[last, last] - half @ half)
        return cls(sums, tuple(names), inverse, gram, used, sizes, lower, solution, deviance)

    @cached_property
    def slopes(self) -> np.ndarray:
        """Derivatives of the deviance by the variances (k,): tr P V' - yᵀ P V' P y."""
        from scipy.linalg import cho_solve, solve_triangular

        result = np.empty(len(self.names))
        whole = cho_solve((self.lower, True), np.eye(len(self.lower)))
        for k, name in enumerate(self.names):
            if name not in self.sums.structures:
                own = self.sums.index(name)
                across = solve_triangular(
                    self.lower, (self.gram[np.ix_(own, self.used)] * self.sizes).T, lower=True
                )
                trace = float(np.trace(self.gram[np.ix_(own, own)]) - np.sum(across**2))
                result[k] = trace - float(np.sum((self.gram[own] @ self.solution) ** 2))
                continue
            structure = self.sums.structures[name]
            if structure.ndim == 2:
                inner = (self.inverse * structure[:, None]) @ self.inverse
                trace = float(np.sum(np.diagonal(self.inverse, axis1=1, axis2=2) * structure))
            else:
                inner = self.inverse @ structure @ self.inverse
                trace = float(np.sum(self.inverse * structure))
            gram = self.sums.gram(inner)
            trace -= float(
                np.sum(whole * gram[np.ix_(self.used, self.used)] * self.sizes * self.sizes[:, None])
            )
            result[k] = trace - float(self.solution @ gram @ self.solution)
        return result

    @cached_property
    def information(self) -> np.ndarray:
        """Average information yᵀ P V' P V'' P y of the variances (k, k), of the deviance (Gilmour, Thompson & Cullis 1995)."""
        from scipy.linalg import solve_triangular

        sums, size = self.sums, self.sums.columns.shape[2]
        errors = sums.columns @ self.solution[:size] + sums.spread(self.solution[size:])
        weighted = np.matmul(self.inverse, errors[:, :, None])
        pushed = np.concatenate([self._pushed(name, weighted) for name in self.names], axis=2)
        moved = np.matmul(self.inverse, pushed)
        along = np.concatenate(
            [sums.columns.reshape(-1, size).T @ moved.reshape(-1, len(self.names)), sums.block_sums(moved)]
        )
        inside = solve_triangular(self.lower, self.sizes[:, None] * along[self.used], lower=True)
        flat = (part.reshape(-1, len(self.names)) for part in (pushed, moved))
        return next(flat).T @ next(flat) - inside.T @ inside

    def _pushed(self, name: str, weighted: np.ndarray) -> np.ndarray:
        """V' (G, 3 T, 1) of one component times P y."""
        sums = self.sums
        if name in sums.blocks:
            every = np.zeros(3 * sums.count)
            own = sums.index(name) - sums.columns.shape[2]
            every[own] = sums.block_sums(weighted)[own, 0]
            return sums.spread(every)[:, :, None]
        if name not in sums.structures:
            waves = sums.columns[:, :, sums.index(name)]
            return waves @ np.einsum("gik,gij->kj", waves, weighted)
        structure = sums.structures[name]
        return structure[:, :, None] * weighted if structure.ndim == 2 else np.matmul(structure, weighted)
