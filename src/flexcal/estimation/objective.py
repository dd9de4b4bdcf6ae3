"""The objective function: loss of the residual groups plus prior."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation.loss import Loss
from flexcal.estimation.problem import Problem
from flexcal.kernels import update


class NotFinite(FlexcalError):
    """A model gives a residual or a derivative that is not finite."""


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
                "E-FIT-007",
                f"groups must hold one integer for each of the {rows} residual rows, "
                f"not an array of shape {groups.shape} and type {groups.dtype}.",
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


@dataclass(frozen=True, eq=False)
class Objective:
    """F(x) = Σ_g ρ(‖r_g(x)‖) + ½‖L(x − x₀)‖², evaluated with checks."""

    problem: Problem
    loss: Loss
    grouping: Grouping
    thresholds: np.ndarray
    prior_rows: np.ndarray
    prior_mean: np.ndarray

    @classmethod
    def of(cls, problem: Problem, loss: Loss, rows: int) -> Objective:
        """For a residual of `rows` rows."""
        grouping = Grouping.of(problem.groups, rows)
        thresholds = loss.thresholds(grouping.sizes)
        return cls(problem, loss, grouping, thresholds, problem.prior_rows(), problem.parameters.prior_mean())

    def linearise(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual (m,) and Jacobian (m, p); raises `NotFinite` when they are not finite."""
        return self.checked(*self.problem.linearise(x))

    def checked(self, residual: np.ndarray, jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same residual (m,) and Jacobian (m, p); raises `NotFinite` when they are not finite."""
        names = self.problem.parameters.names
        rows = self.grouping.number.size
        if np.shape(residual) != (rows,) or np.shape(jacobian) != (rows, len(names)):
            raise FlexcalError(
                "E-FIT-008",
                f"linearise returned shapes {np.shape(residual)} and {np.shape(jacobian)}; "
                f"{rows} rows and {len(names)} parameters need ({rows},) and ({rows}, {len(names)}).",
            )
        if not np.all(np.isfinite(residual)):
            row = int(np.argmin(np.isfinite(residual)))
            raise NotFinite(
                "E-FIT-009", f"The residual's row {row} is not finite; check the data and the model there."
            )
        if not np.all(np.isfinite(jacobian)):
            name = names[int(np.argmin(np.all(np.isfinite(jacobian), axis=0)))]
            raise NotFinite(
                "E-FIT-010", f"The derivative of the residual by {name} is not finite; check the model there."
            )
        return residual, jacobian

    def trial(self, x: np.ndarray) -> tuple[float, tuple[np.ndarray, np.ndarray] | None]:
        """Cost at `x`, infinite where the model cannot be evaluated, and the linearisation if that came with it."""
        linearised = None
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            try:
                if self.problem.residual is None:
                    linearised = self.linearise(x)
                    residual = linearised[0]
                else:
                    residual = self.problem.residual(x)
            except FlexcalError:
                return math.inf, None
            cost = self.cost(residual, x)
        return (cost, linearised) if math.isfinite(cost) else (math.inf, None)

    def cost(self, residual: np.ndarray, x: np.ndarray) -> float:
        """F(x)."""
        prior = self.prior_rows @ (x - self.prior_mean)
        data = self.loss.cost(self.grouping.norms(residual), self.thresholds)
        return float(np.sum(data) + 0.5 * prior @ prior)

    def weights(self, residual: np.ndarray) -> np.ndarray:
        """Robust weight (G,) of every group."""
        return self.loss.weight(self.grouping.norms(residual), self.thresholds)

    def triangular(
        self, x: np.ndarray, residual: np.ndarray, jacobian: np.ndarray, weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """R (p, p), c (p,) and ‖b‖ of the rows [A b] = [√w J, √w r; L, L(x − x₀)], where A = QR and c = Qᵀb.

        One QR of [A b] without Q; with fewer rows than parameters R and c have fewer rows.
        """
        rows, size = jacobian.shape
        table = np.empty((rows + self.prior_rows.shape[0], size + 1), order="F")
        table[:rows, :size] = jacobian
        table[:rows, size] = residual
        if np.any(weights != 1.0):
            table[:rows] *= np.sqrt(weights)[self.grouping.number][:, None]
        table[rows:, :size] = self.prior_rows
        table[rows:, size] = self.prior_rows @ (x - self.prior_mean)
        norm = float(np.linalg.norm(table[:, size]))
        factor = np.zeros((size + 1, size + 1))
        update(factor, table.T)
        kept = min(size, len(table))
        return factor[:kept, :size], factor[:kept, size], norm
