"""Restricted likelihood of variance components of measured points, from sums over visits to poses and over blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.calibration.error_model.arrowhead_matrix import Arrowhead, ArrowheadFactor
from flexcal.calibration.error_model.error_components import ErrorComponents
from flexcal.calibration.error_model.groups import COMMAND
from flexcal.calibration.error_model.incidence_matrices import added
from flexcal.calibration.error_model.point_sums import PointSums
from flexcal.calibration.error_model.whitening import cholesky_inverses


@dataclass(frozen=True, eq=False)
class RestrictedLikelihood:
    """Restricted likelihood at given components, with P = V⁻¹ - V⁻¹X(XᵀV⁻¹X)⁻¹XᵀV⁻¹ of the parameters X; V includes the shared errors.

    `inverse` (G, 3 T, 3 T) is that of the visits' own covariance; `sizes` are the standard deviations of all columns C: 1 for X and what is
    known of them beforehand, 0 for columns that are no part of the model, the residual among them; `outer` is that of the commands, whose
    columns go first; `factor` L with L Lᵀ = S Cᵀ V₀⁻¹ C S + (0 for X, else 1).
    """

    sums: PointSums
    names: tuple[str, ...]
    inverse: np.ndarray
    gram: Arrowhead
    sizes: np.ndarray
    outer: float
    factor: ArrowheadFactor
    solution: np.ndarray
    deviance: float

    @classmethod
    def of(cls, sums: PointSums, names: Sequence[str], scatter: ErrorComponents) -> RestrictedLikelihood:
        """Likelihood at a scatter, with derivatives by the variances of the components `names`."""
        whitening = cholesky_inverses(sums.covariance(scatter, commands=COMMAND in names))
        inverse = np.swapaxes(whitening, 1, 2) @ whitening
        gram = sums.gram(whitening, inverse, commands=COMMAND in names)
        sizes, outer = np.zeros(len(gram.corner)), scatter.command
        sizes[: sums.fixed] = 1.0
        for name in _shared(names, sums):
            sizes[sums.index(name)] = getattr(scatter, name)
        free = np.arange(len(sizes)) < sums.fit.free.shape[2]
        lower = gram.scaled(outer, sizes).plus_identity(~free).factored()
        first, last = len(gram.border), sums.columns.shape[2] - 1
        half = lower.half(gram.rows(outer, sizes, np.array([last])))
        effects = -lower.other_half(half)[:, 0]
        solution = np.concatenate([outer * effects[:first], sizes * effects[first:]])
        solution[first + last] = 1.0
        deviance = lower.log_determinant - 2 * float(np.log(np.diagonal(whitening, axis1=1, axis2=2)).sum())
        deviance += float(gram.corner[last, last] - np.sum(half**2))
        return cls(sums, tuple(names), inverse, gram, sizes, outer, lower, solution, deviance)

    def products(self, columns: np.ndarray) -> np.ndarray:
        """Matrix CᵀPC (k, k) of the `columns` (k,) with these numbers."""
        half = self.factor.half(self.gram.rows(self.outer, self.sizes, columns))
        return self.gram.corner[np.ix_(columns, columns)] - half.T @ half

    @cached_property
    def slopes(self) -> np.ndarray:
        """Derivatives of the deviance by the variances (k,): tr P V' - yᵀ P V' P y."""
        sums, by_column, result = self.sums, self._slopes_by_column, np.empty(len(self.names))
        for k, name in enumerate(self.names):
            if name == COMMAND and sums.commands is not None:
                result[k] = self._slope_by_commands() + self._slope_by_visits(sums.commands.once)
            elif name in sums.structures:
                result[k] = self._slope_by_visits(sums.structures[name])
            else:
                result[k] = float(by_column[sums.index(name)].sum())
        return result

    @cached_property
    def _slopes_by_column(self) -> np.ndarray:
        """Derivative of the deviance by the variance of every column of the corner that points share, zero for the others."""
        gram, shared = self.gram, [self.sums.index(name) for name in _shared(self.names, self.sums)]
        result = np.zeros(len(gram.corner))
        if shared:
            random = np.concatenate(shared)
            half = self.factor.half(gram.rows(self.outer, self.sizes, random))
            pushed = gram.times(self.solution)[len(gram.border) + random]
            result[random] = np.diag(gram.corner)[random] - (half**2).sum(axis=0) - pushed**2
        return result

    def _slope_by_commands(self) -> float:
        """Derivative by the variance of an error shared by all visits of a command."""
        gram, outer = self.gram, self.outer
        trace = sum(float(np.trace(own, axis1=1, axis2=2).sum()) for own in gram.blocks)
        blocks = tuple(outer * own for own in gram.blocks)
        across = Arrowhead(blocks, gram.border * self.sizes, np.zeros((len(self.sizes), 0)))
        pushed = gram.times(self.solution)[: len(gram.border)]
        return trace - self.factor.squares(across) - float(pushed @ pushed)

    def _slope_by_visits(self, structure: np.ndarray) -> float:
        """Derivative by the variance of an error independent in every visit, (G, 3 T, 3 T) or its diagonal (G, 3 T)."""
        if structure.ndim == 2:
            return float(np.sum(np.diagonal(self._by_covariance, axis1=1, axis2=2) * structure))
        return float(np.sum(self._by_covariance * structure))

    @cached_property
    def _by_covariance(self) -> np.ndarray:
        """Derivative (G, 3 T, 3 T) of the deviance by the visits' own covariance."""
        spread = self.sums.gram_adjoint(self._weights)
        return self.inverse - self.inverse @ spread @ self.inverse

    @cached_property
    def _weights(self) -> Arrowhead:
        """Weights of the products CᵀV⁻¹V'V⁻¹C of all columns C in the derivatives of the deviance: S M⁻¹ S, and s sᵀ of the solution s."""
        inverse, first = self.factor.selected_inverse, len(self.gram.border)
        outer, inner = self.solution[:first], self.solution[first:]
        corner = inverse.corner * self.sizes * self.sizes[:, None] + inner[:, None] * inner
        border = inverse.border * (self.outer * self.sizes) + outer[:, None] * inner
        blocks, last = [], 0
        for values in inverse.blocks:
            own = outer[last : (last := last + values.shape[0] * values.shape[1])].reshape(values.shape[:2])
            blocks.append(self.outer**2 * values + own[:, :, None] * own[:, None])
        return Arrowhead(tuple(blocks), border, corner)

    @cached_property
    def information(self) -> np.ndarray:
        """Average information yᵀ P V' P V'' P y of the variances (k, k), of the deviance (Gilmour, Thompson & Cullis 1995)."""
        sums, size, first = self.sums, self.sums.columns.shape[2], len(self.gram.border)
        errors = sums.columns @ self.solution[first : first + size] + sums.spread(
            self.solution[first + size :]
        )
        if sums.commands is not None and COMMAND in self.names:
            errors += sums.commands.spread(self.solution[:first]).reshape(errors.shape)
        weighted = np.matmul(self.inverse, errors[:, :, None])
        pushed = np.concatenate([self._pushed(name, weighted) for name in self.names], axis=2)
        moved = np.matmul(self.inverse, pushed)
        along = np.concatenate(
            [sums.columns.reshape(-1, size).T @ moved.reshape(-1, len(self.names)), added(sums.sums, moved)]
        )
        along = self.sizes[:, None] * along
        if sums.commands is not None and COMMAND in self.names:
            along = np.concatenate([self.outer * added(sums.commands.sums, moved), along])
        inside = self.factor.half(along)
        flat = (part.reshape(-1, len(self.names)) for part in (pushed, moved))
        return next(flat).T @ next(flat) - inside.T @ inside

    def _pushed(self, name: str, weighted: np.ndarray) -> np.ndarray:
        """Product V' P y (G, 3 T, 1) for one component."""
        sums = self.sums
        if name == COMMAND and sums.commands is not None:
            again = sums.commands.spread(added(sums.commands.sums, weighted)).reshape(weighted.shape)
            return again + sums.commands.once[:, :, None] * weighted
        if name in sums.blocks:
            every = np.zeros(3 * sums.count)
            own = sums.index(name) - sums.columns.shape[2]
            every[own] = added(sums.sums, weighted)[own, 0]
            return sums.spread(every)[:, :, None]
        if name not in sums.structures:
            waves = sums.columns[:, :, sums.index(name)]
            return waves @ np.einsum("gik,gij->kj", waves, weighted)
        structure = sums.structures[name]
        return structure[:, :, None] * weighted if structure.ndim == 2 else np.matmul(structure, weighted)


def _shared(names: Sequence[str], sums: PointSums) -> list[str]:
    """Components with columns in the corner: waves of transmission errors, cells and stretches."""
    return [name for name in names if name not in (*sums.structures, COMMAND)]
