"""Sensitivity of candidate measurements, the input of the design of experiments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation.parameter import Parameters


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Whitened Jacobian rows of every candidate measurement: `jacobian` (candidates, rows, p) in estimation coordinates.

    `prior_information` (p, p) is what is known before measuring; zeros for nothing. No data are needed.
    Raises FlexcalError when shapes do not fit or the prior is not positive semidefinite.
    """

    jacobian: np.ndarray
    parameters: Parameters
    prior_information: np.ndarray

    def __post_init__(self) -> None:
        size = len(self.parameters)
        if self.jacobian.ndim != 3 or self.jacobian.shape[2] != size:
            raise FlexcalError(
                "E-FIT-022",
                f"The sensitivity has shape {self.jacobian.shape}; {size} parameters need (candidates, rows, {size}).",
            )
        if self.prior_information.shape != (size, size):
            raise FlexcalError(
                "E-FIT-023",
                f"prior_information has shape {self.prior_information.shape}, not ({size}, {size}).",
            )
        self.prior_rows()

    def __len__(self) -> int:
        """Number of candidates."""
        return self.jacobian.shape[0]

    def subset(self, chosen: Sequence[int] | np.ndarray) -> Sensitivity:
        """The chosen candidates only."""
        return Sensitivity(self.jacobian[np.asarray(chosen)], self.parameters, self.prior_information)

    def prior_rows(self) -> np.ndarray:
        """L (p, p) with LᵀL = prior_information, which may be singular."""
        root = np.sqrt(np.maximum(np.diag(self.prior_information), 0.0))
        root[root == 0] = 1.0
        values, vectors = np.linalg.eigh(self.prior_information / np.outer(root, root))
        if np.min(values, initial=0.0) < -1e-9 * max(1.0, float(np.max(np.abs(values), initial=0.0))):
            raise FlexcalError(
                "E-FIT-024", "prior_information has a negative eigenvalue; an information matrix cannot."
            )
        return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T * root

    def factor(self, chosen: Sequence[int] | np.ndarray | None = None) -> np.ndarray:
        """Triangular R (p, p) with RᵀR = prior information + Σ JᵀJ over the chosen candidates (all by default)."""
        rows = self.jacobian if chosen is None else self.jacobian[np.asarray(chosen, dtype=int)]
        stacked = np.vstack([rows.reshape(-1, len(self.parameters)), self.prior_rows()])
        return np.asarray(np.linalg.qr(stacked, mode="r"))

    def covariance(self, chosen: Sequence[int] | np.ndarray | None = None) -> np.ndarray:
        """Predicted posterior covariance (p, p) in estimation coordinates.

        Raises FlexcalError, naming one, when the chosen candidates and the prior leave a combination undetermined.
        """
        from scipy.linalg import solve_triangular

        from flexcal.estimation.identifiability import analyse

        factor = self.factor(chosen)
        identifiability = analyse(factor, self.parameters.names)
        if identifiability.rank < len(self.parameters):
            raise FlexcalError(
                "E-FIT-025",
                f"The chosen measurements determine {identifiability.rank} of {len(self.parameters)} parameters "
                f"(not, for one, {identifiability.weak_directions(1)[0][1]}); choose more, or give a prior.",
            )
        root = solve_triangular(factor, np.eye(len(self.parameters)))
        return root @ root.T
