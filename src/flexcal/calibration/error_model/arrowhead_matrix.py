"""Symmetric block-diagonal matrices bordered by a few columns (block arrowhead matrices)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.calibration.error_model.whitening import cholesky_inverses
from flexcal.errors import FlexcalError
from flexcal.kernels import triangular_inverse


@dataclass(frozen=True, eq=False)
class Arrowhead:
    """Arrowhead matrix M = [[B, F], [Fᵀ, D]]: `border` F (b, d), `corner` D (d, d), and the diagonal `blocks` of B in their order, (k,
    m, m) of one size.
    """

    blocks: tuple[np.ndarray, ...]
    border: np.ndarray
    corner: np.ndarray

    def scaled(self, outer: float, inner: np.ndarray) -> Arrowhead:
        """Scaled matrix S M S; the diagonal matrix S has `outer` for the first b rows and `inner` (d,) for the others."""
        blocks = tuple(outer**2 * values for values in self.blocks)
        return Arrowhead(blocks, self.border * (outer * inner), self.corner * inner * inner[:, None])

    def rows(self, outer: float, inner: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Rows S M (b + d, k) of some `columns` (k,) of the corner, S as in `scaled`."""
        return np.concatenate([outer * self.border[:, columns], inner[:, None] * self.corner[:, columns]])

    def plus_identity(self, inner: np.ndarray) -> Arrowhead:
        """Matrix M with 1 added to the diagonal of B and, where `inner` (d,) is set, of D."""
        blocks = tuple(values + np.eye(values.shape[1]) for values in self.blocks)
        return Arrowhead(blocks, self.border, self.corner + np.diag(inner.astype(float)))

    def times(self, vector: np.ndarray) -> np.ndarray:
        """Product M v (b + d,)."""
        first, last = vector[: len(self.border)], vector[len(self.border) :]
        upper = self.border @ last + _by_blocks(self.blocks, first[:, None])[:, 0]
        return np.concatenate([upper, self.border.T @ first + self.corner @ last])

    def factored(self) -> ArrowheadFactor:
        """Cholesky factor, with B eliminated first; raises `FlexcalError` if M is not positive definite."""
        inverses = tuple(cholesky_inverses(values) for values in self.blocks)
        border = _by_blocks(inverses, self.border)
        try:
            factor = np.linalg.cholesky(self.corner - border.T @ border)
        except np.linalg.LinAlgError:
            raise FlexcalError(
                "E-CAL-037",
                "the sizes of the errors cannot be computed: measurements and robot are too far apart for the accuracy of the numbers; "
                "check the units of both.",
            ) from None
        corner = np.empty_like(factor)
        triangular_inverse(factor, corner)
        return ArrowheadFactor(inverses, border, corner)


@dataclass(frozen=True, eq=False)
class ArrowheadFactor:
    """Cholesky factor L with L Lᵀ = M: `inverses` of the blocks' factors L_B, `border` L_B⁻¹ F (b, d), and `corner` L_S⁻¹ (d, d), the
    inverse of the factor of S = D - Fᵀ B⁻¹ F.
    """

    inverses: tuple[np.ndarray, ...]
    border: np.ndarray
    corner: np.ndarray

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant, ln det M."""
        diagonals = [np.diagonal(values, axis1=1, axis2=2).ravel() for values in self.inverses]
        return -2 * float(np.log(np.concatenate([*diagonals, np.diag(self.corner)])).sum())

    def half(self, columns: np.ndarray) -> np.ndarray:
        """Forward substitution L⁻¹ C of columns (b + d, k)."""
        count = len(self.border)
        upper = _by_blocks(self.inverses, columns[:count])
        lower = self.corner @ (columns[count:] - self.border.T @ upper)
        return np.concatenate([upper, lower])

    def other_half(self, columns: np.ndarray) -> np.ndarray:
        """Back substitution L⁻ᵀ C of columns (b + d, k)."""
        count = len(self.border)
        lower = self.corner.T @ columns[count:]
        return np.concatenate([_by_blocks(self._turned, columns[:count] - self.border @ lower), lower])

    @cached_property
    def selected_inverse(self) -> Arrowhead:
        """Entries of M⁻¹ where M has blocks, border and corner (Takahashi, Fagan & Chin 1973)."""
        blocks, first = [], 0
        for inverse in self.inverses:
            rows = slice(first, first + inverse.shape[0] * inverse.shape[1])
            shape = *inverse.shape[:2], -1
            beside = np.swapaxes(self._eliminated[rows].reshape(shape), 1, 2)
            blocks.append(np.swapaxes(inverse, 1, 2) @ inverse + self._spread[rows].reshape(shape) @ beside)
            first = rows.stop
        return Arrowhead(tuple(blocks), -self._spread, self._corner_inverse)

    def squares(self, other: Arrowhead) -> float:
        """Squared norm ‖L⁻¹ A‖² of the first b columns of an `other` matrix A with blocks of the same sizes."""
        whole, first = 0.0, 0
        lower = other.border.T.copy()
        for inverse, values in zip(self.inverses, other.blocks, strict=True):
            half, rows = inverse @ values, slice(first, first + values.shape[0] * values.shape[1])
            whole += float(np.sum(half**2))
            border = self.border[rows].reshape(len(half), half.shape[1], -1)
            lower[:, rows] -= np.matmul(np.swapaxes(half, 1, 2), border).reshape(-1, border.shape[2]).T
            first = rows.stop
        return whole + float(np.sum(self._corner_inverse * (lower @ lower.T)))

    @property
    def _turned(self) -> tuple[np.ndarray, ...]:
        return tuple(np.swapaxes(values, 1, 2) for values in self.inverses)

    @cached_property
    def _corner_inverse(self) -> np.ndarray:
        """Inverse S⁻¹ (d, d) of the Schur complement."""
        return self.corner.T @ self.corner

    @cached_property
    def _eliminated(self) -> np.ndarray:
        """Product B⁻¹ F (b, d)."""
        return _by_blocks(self._turned, self.border)

    @cached_property
    def _spread(self) -> np.ndarray:
        """Product B⁻¹ F S⁻¹ (b, d)."""
        return self._eliminated @ self._corner_inverse


def _by_blocks(blocks: Sequence[np.ndarray], columns: np.ndarray) -> np.ndarray:
    """Product of a block-diagonal matrix with columns (b, k)."""
    result, first = np.empty(columns.shape), 0
    for values in blocks:
        last = first + values.shape[0] * values.shape[1]
        own = columns[first:last].reshape(*values.shape[:2], columns.shape[1])
        result[first:last] = np.matmul(values, own).reshape(-1, columns.shape[1])
        first = last
    return result
