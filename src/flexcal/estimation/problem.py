"""A nonlinear least-squares problem with a Gaussian prior."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation.parameter import Parameters


@dataclass(frozen=True, eq=False)
class Problem:
    """Minimise ½|r(x)|² + ½(x − x₀)ᵀ C⁻¹ (x − x₀) over the estimation coordinates x (p,).

    `linearise(x)` returns the whitened residual r (m,) = (measurement − model)/σ and J = ∂r/∂x (m, p) in estimation
    coordinates; `residual(x)` returns r alone and is worth giving when it is cheaper. The prior is that of `parameters`,
    with C diagonal, unless `prior_covariance` (p, p) replaces it (an infinite diagonal entry is no prior on that parameter).
    `groups` (m,) labels, with integers, the rows that belong to one measurement (the coordinates of a point, the real and
    imaginary parts of a line): the units of the robust loss and the clusters of the sandwich; None is one row each.
    Where the model cannot be evaluated, `linearise` and `residual` may return NaN or raise FlexcalError: a step there is
    rejected.
    """

    parameters: Parameters
    linearise: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    residual: Callable[[np.ndarray], np.ndarray] | None = None
    prior_covariance: np.ndarray | None = None
    groups: np.ndarray | None = None

    def prior_rows(self) -> np.ndarray:
        """L (k, p) with LᵀL the prior's information: the prior is the extra rows L(x − x₀) of the residual.

        Raises FlexcalError when `prior_covariance` has the wrong shape or is not positive definite.
        """
        size = len(self.parameters)
        if self.prior_covariance is None:
            std = self.parameters.prior_std()
            return np.diag(1.0 / std)[np.isfinite(std)]
        covariance = np.asarray(self.prior_covariance, dtype=float)
        if covariance.shape != (size, size):
            raise FlexcalError(
                "E-FIT-019",
                f"prior_covariance has shape {covariance.shape}; {size} parameters need ({size}, {size}).",
            )
        known = np.flatnonzero(np.isfinite(np.diag(covariance)))
        block = covariance[np.ix_(known, known)]
        std = np.sqrt(np.maximum(np.diag(block), 0.0))
        if not np.all(std > 0):
            names = [self.parameters.names[i] for i in known[std <= 0]]
            raise FlexcalError(
                "E-FIT-020",
                f"prior_covariance gives {', '.join(names)} no variance; fix such parameters in the model.",
            )
        try:
            factor = np.linalg.cholesky(block / np.outer(std, std))
        except np.linalg.LinAlgError:
            raise FlexcalError(
                "E-FIT-021",
                "prior_covariance is not positive definite; two parameters are tied exactly, so estimate only one of them.",
            ) from None
        rows = np.zeros((known.size, size))
        rows[:, known] = np.linalg.solve(factor, np.diag(1.0 / std))
        return rows
