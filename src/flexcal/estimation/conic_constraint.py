"""Linear matrix inequality: a symmetric matrix, linear in the parameters, that must be positive definite."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Cone:
    """Cone constraint X = Σ χ_i basis_i, i in `column_indices` (k,), `basis` (k, m, m), which must stay above `floor` times its
    `reference` (m, m).

    Everything is told relative to the reference L Lᵀ, as E = L⁻¹ X L⁻ᵀ, so that no unit and no size of link counts more than another.
    A prior with the standard deviation `std` takes E for 1; inf is none.
    """

    column_indices: np.ndarray
    basis: np.ndarray
    reference: np.ndarray
    floor: float
    std: float

    @property
    def size(self) -> int:
        """Size m of the matrix."""
        return len(self.reference)

    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """E at the column indices as a vector, matrix (m (m + 1) / 2, k), and 1 as a vector; lengths are those of the Frobenius norm.

        Upper triangle column by column, off-diagonal entries times √2, as Clarabel has positive semidefinite matrices.
        """
        inverse = np.linalg.inv(np.linalg.cholesky(self.reference))
        return _vector(inverse @ self.basis @ inverse.T).T, _vector(np.eye(self.size))

    def smallest(self, parameters: np.ndarray) -> float:
        """The smallest eigenvalue of E at `parameters` (p,) of all columns."""
        inverse = np.linalg.inv(np.linalg.cholesky(self.reference))
        matrix = np.tensordot(parameters[self.column_indices], self.basis, 1)
        return float(np.linalg.eigvalsh(inverse @ matrix @ inverse.T)[0])


def _vector(matrices: np.ndarray) -> np.ndarray:
    columns, rows = np.tril_indices(matrices.shape[-1])
    return matrices[..., rows, columns] * np.where(rows == columns, 1.0, np.sqrt(2.0))
