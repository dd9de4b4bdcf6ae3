"""Whitening of readings by the Cholesky factors of their covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Whitening:
    """Matrix W with WᵀW the inverse covariance of all readings: `own` (R, 3, 3) on its diagonal and `across` (M, 3, 3) from the points
    `beside` (M,), by number, to the orientations, which are the last M readings; None where points and orientations are independent.
    """

    own: np.ndarray
    across: np.ndarray | None = None
    beside: np.ndarray | None = None

    @classmethod
    def of(cls, blocks: np.ndarray, across: np.ndarray | None, beside: np.ndarray) -> Whitening:
        """Whitening of covariances `blocks` (R, 3, 3) of the readings, and `across` (M, 3, 3) of orientations with their points."""
        if across is None:
            return cls(cholesky_inverses(blocks))
        own = np.empty_like(blocks)
        points = len(blocks) - len(beside)
        alone = np.setdiff1d(np.arange(points), beside)
        own[alone] = cholesky_inverses(blocks[alone])
        whole = np.empty((len(beside), 6, 6))
        whole[:, :3, :3], whole[:, 3:, 3:] = blocks[beside], blocks[points:]
        whole[:, 3:, :3], whole[:, :3, 3:] = across, np.swapaxes(across, 1, 2)
        factor = cholesky_inverses(whole)
        own[beside], own[points:] = factor[:, :3, :3], factor[:, 3:, 3:]
        return cls(own, factor[:, 3:, :3], beside)

    def __call__(self, rows: np.ndarray) -> np.ndarray:
        """Product with `rows` (R, 3) or (R, 3, m), stacked: (3 R,) or (3 R, m)."""
        columns = rows.reshape(len(rows), 3, -1)
        result = np.matmul(self.own, columns)
        if self.across is not None:
            result[len(rows) - len(self.across) :] += np.matmul(self.across, columns[self.beside])
        return result.reshape(3 * len(rows), *rows.shape[2:])

    def transposed(self, rows: np.ndarray) -> np.ndarray:
        """Product of the transpose with `rows` (R, 3, m), (R, 3, m)."""
        result = np.matmul(np.swapaxes(self.own, 1, 2), rows)
        if self.across is not None and self.beside is not None:
            turned = rows[len(rows) - len(self.across) :]
            np.add.at(result, self.beside, np.matmul(np.swapaxes(self.across, 1, 2), turned))
        return result

    def subset(self, rows: np.ndarray) -> Whitening:
        """Whitening of the readings of a mask (R,) that keeps point and orientation of a pose together."""
        if self.across is None or self.beside is None:
            return Whitening(self.own[rows])
        kept = rows[len(rows) - len(self.across) :]
        number = np.cumsum(rows) - 1
        return Whitening(self.own[rows], self.across[kept], number[self.beside[kept]])


def cholesky_inverses(blocks: np.ndarray) -> np.ndarray:
    """Inverses L⁻¹ of the Cholesky factors of positive definite matrices (k, m, m), by forward substitution in all of them together."""
    factors = np.linalg.cholesky(blocks)
    inverses = np.zeros_like(factors)
    pivots = 1 / np.diagonal(factors, axis1=1, axis2=2)
    for i in range(blocks.shape[1]):
        above = np.matmul(factors[:, i, None, :i], inverses[:, :i, :i])[:, 0]
        inverses[:, i, :i] = -pivots[:, i, None] * above
        inverses[:, i, i] = pivots[:, i]
    return inverses
