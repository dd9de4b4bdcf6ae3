"""Scalar products of the columns of a linear fit and of blocks with a common error, from sums over visits to poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.error_model.arrowhead_matrix import Arrowhead
from flexcal.calibration.error_model.command_sums import CommandSums
from flexcal.calibration.error_model.error_components import ErrorComponents, stated_covariance, translations
from flexcal.calibration.error_model.groups import COMMAND
from flexcal.calibration.error_model.incidence_matrices import (
    Incidence,
    added,
    by_axes,
    by_visits,
    incidence,
    pairs_of,
)
from flexcal.calibration.measurement import RADIANS, ROBOT

if TYPE_CHECKING:
    from flexcal.calibration.error_model.variance_components import LinearFit


@dataclass(frozen=True, eq=False)
class PointSums:
    """Columns of a linear fit by visits to poses, and the sums for scalar products of columns shared by blocks.

    `columns` (G, 3 T, p + w + k + 1) are those of the fit, w waves of transmission errors, k further ones and, the last, its residual;
    `least` (G, 3 T, 3 T) is the visits' covariance V without any component, `structures` are ∂V/∂variance of the components that visits
    have on their own, (G, 3 T, 3 T) or as diagonals (G, 3 T); `blocks` says which of K cells and stretches are a component's; `sums`
    (K, G T) and `pairs` (K K, G T T) add rows, and pairs of rows of one visit, that belong to one, and to a pair of them. `commands` does
    so for errors of commands, of which there may be half as many as points.
    """

    fit: LinearFit
    columns: np.ndarray
    least: np.ndarray
    structures: dict[str, np.ndarray]
    blocks: dict[str, np.ndarray]
    sums: Incidence
    pairs: Incidence
    commands: CommandSums | None

    @classmethod
    def of(cls, fit: LinearFit, further: np.ndarray | None = None) -> PointSums:
        """Sums of a fit, with `further` columns (N, 3, k) that do not belong to it."""
        more = np.zeros((*fit.residual.shape, 0)) if further is None else further
        cells = fit.cells
        columns = cells.gathered(
            np.concatenate([fit.free, fit.tied, fit.waves, more, fit.residual[:, :, None]], axis=2)
        )
        turned = cells.gathered(fit.turns)
        together = cells.gathered(translations(fit.readings))
        structures = {
            name: cells.gathered(fit.readings.of_scatter(name).astype(float))
            for name in (ROBOT, *fit.readings.instruments)
        }
        structures |= {
            "orientation": cells.gathered((fit.readings.unit == RADIANS).astype(float)),
            "share": stated_covariance(fit.readings, cells),
            "pose": together @ np.swapaxes(together, 1, 2),
            "angular": turned @ np.swapaxes(turned, 1, 2),
        }
        if cells.visits.shape[1] > 1:
            structures |= {
                name: turned[:, :, None, k] * turned[:, None, :, k]
                for k, name in enumerate(joint_components(turned.shape[2]))
            }
        least = ErrorComponents(share=0.0).jointly(fit.readings, fit.turns, cells)
        blocks, labels, count = {}, [], 0
        for name, own in cells.blocks.items():
            if name != COMMAND:
                size = int(own.max()) + 1
                blocks[name] = np.arange(count, count + size)
                known = (cells.visits >= 0) & (own[cells.visits] >= 0)
                labels.append(np.where(known, own[cells.visits] + count, -1))
                count += size
        label = np.stack(labels, axis=2) if labels else np.zeros((*cells.visits.shape, 0), dtype=int)
        rows = np.arange(cells.visits.size).reshape(*cells.visits.shape, 1)
        sums = incidence(label, rows, (count, cells.visits.size))
        commands = None if cells.command is None else CommandSums.of(cells, label, count)
        pairs = pairs_of(label, label, count, count)
        return cls(fit, columns, least, structures, blocks, sums, pairs, commands)

    def covariance(self, scatter: ErrorComponents, *, commands: bool) -> np.ndarray:
        """Covariance (G, 3 T, 3 T) that visits have on their own, as `ErrorComponents.jointly`; with the error of commands that were
        visited once where `commands` have one.
        """
        whole = self.least.copy()
        diagonal = np.einsum("gii->gi", whole)
        turning = dict(zip(joint_components(len(scatter.joints)), scatter.turning, strict=True))
        turning["angular"] = 0.0 if scatter.joints else scatter.angular
        for name, structure in self.structures.items():
            std = turning.get(name, 0.0) if name in self.turning else getattr(scatter, name)
            if not std:
                continue
            if structure.ndim == 2:
                diagonal += std**2 * structure
            else:
                whole += std**2 * structure
        if commands and self.commands is not None:
            diagonal += scatter.command**2 * self.commands.once
        return whole

    def gram(self, whitening: np.ndarray, inverse: np.ndarray, *, commands: bool) -> Arrowhead:
        """Gram matrix CᵀQC of all columns C with Q = WᵀW given by the blocks W, the `whitening`, and Q, the `inverse` (G, 3 T, 3 T).

        The corner is of `columns` and of the cells and stretches (three columns each, 1 where a point belongs to it); the blocks are of
        the commands, where they are asked for.
        """
        size, count = self.columns.shape[2], self.count
        white = np.matmul(whitening, self.columns)
        moved, flat = np.matmul(np.swapaxes(whitening, 1, 2), white), white.reshape(-1, size)
        corner = np.empty((size + 3 * count, size + 3 * count))
        corner[:size, :size] = flat.T @ flat
        entries = by_axes(inverse)
        if count:
            corner[size:, :size] = added(self.sums, moved)
            corner[:size, size:] = corner[size:, :size].T
            own = (self.pairs @ entries).reshape(count, count, 3, 3)
            corner[size:, size:] = own.transpose(0, 2, 1, 3).reshape(3 * count, 3 * count)
        if self.commands is None or not commands:
            return Arrowhead((), np.zeros((0, len(corner))), corner)
        border = np.concatenate([added(self.commands.sums, moved), self.commands.crossed(entries)], axis=1)
        return Arrowhead(self.commands.blocks(entries), border, corner)

    def gram_adjoint(self, weights: Arrowhead) -> np.ndarray:
        """Blocks D (G, 3 T, 3 T) with Σ tr Dᵀ Q = ⟨`weights`, CᵀQC⟩ for every Q of symmetric blocks: the adjoint of `gram`."""
        size, count, corner = self.columns.shape[2], self.count, weights.corner
        visits, coordinates = self.columns.shape[:2]
        half = (self.columns.reshape(-1, size) @ corner[:size, :size]).reshape(visits, coordinates, size)
        entries = np.zeros((visits * (coordinates // 3) ** 2, 9))
        if count:
            half += 2 * (self.sums.T @ corner[size:, :size].reshape(count, -1)).reshape(half.shape)
            own = corner[size:, size:].reshape(count, 3, count, 3).transpose(0, 2, 1, 3)
            entries += self.pairs.T @ own.reshape(-1, 9)
        if self.commands is not None and weights.blocks:
            half += 2 * self.commands.placed(weights.border[:, :size]).reshape(half.shape)
            entries += self.commands.entries(weights.blocks, weights.border[:, size:])
        return half @ np.swapaxes(self.columns, 1, 2) + by_visits(entries, coordinates // 3)

    @property
    def turning(self) -> tuple[str, ...]:
        """Names of the components of rotations of the joints: of all alike, and of each."""
        return "angular", *joint_components(self.fit.turns.shape[2])

    @property
    def count(self) -> int:
        """Number of cells and stretches."""
        return sum(len(own) for own in self.blocks.values())

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Errors (G, 3 T) of all points from the errors (3 K,) of each cell and stretch."""
        return (self.sums.T @ values.reshape(-1, 3)).reshape(len(self.columns), -1)

    @property
    def fixed(self) -> int:
        """Number of columns of the fit, which come first."""
        return self.fit.free.shape[2] + self.fit.tied.shape[2]

    def index(self, name: str) -> np.ndarray:
        """Column numbers of a component in the corner: of its cells or stretches, or of the waves."""
        if name not in self.blocks:
            return self.fixed + np.arange(self.fit.waves.shape[2])
        first = self.columns.shape[2] + 3 * self.blocks[name]
        return (first[:, None] + np.arange(3)).ravel()


def joint_components(count: int) -> tuple[str, ...]:
    """Names of the components of single joints."""
    return tuple(f"joint {k}" for k in range(count))
