"""Overdetermined system W χ + ρ = Y from recordings (Eq. 2.26), one triangular factor per equation and experiment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.data.recordings import Decimation
from flexcal.dynamics.inverse_model import BaseParameters, Equations
from flexcal.dynamics.regression.batches import BATCHES, Batch, ExperimentSystem, experiment_system, reduced
from flexcal.dynamics.regression.triangular_factor import TriangularFactor
from flexcal.dynamics.signals import Experiment, Window
from flexcal.model.parts import LINK_PARAMETERS

_SILENT = 1e-9
"""Size of a column, relative to the largest of its kind, below which it is zero."""
_ALL_BATCHES = 512
"""Largest number of batches of all experiments together, unless there are more experiments."""


@dataclass(frozen=True, eq=False)
class Subsystem:
    """One of an observation's equations in one experiment; `column_indices` are the numbers of its columns among all.

    `undriven` tells that its right-hand side is zero, as of a bearing.
    """

    equation: int
    experiment: int
    column_indices: np.ndarray
    triangle: TriangularFactor
    undriven: bool = False

    def floored(self, sigma: float) -> float:
        """Noise level (N m), at least 1e-12 of the torque, for exactly fitted equations."""
        size = float(np.linalg.norm(self.triangle.right)) / np.sqrt(self.triangle.rows)
        return max(sigma, 1e-12 * size) or 1.0


@dataclass(frozen=True, eq=False)
class RegressionData:
    """Data of a linear estimator; `masked` is the number of rows left out because the robot stood still.

    `batches` are the same equations once more, experiment by experiment in parts that follow each other in time.
    """

    observation: Equations
    base: BaseParameters
    subsystems: tuple[Subsystem, ...]
    masked: int
    batches: tuple[tuple[Batch, ...], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns."""
        return self.observation.names

    @property
    def silent(self) -> tuple[str, ...]:
        """Names of drive columns that are zero in these equations, or rounding relative to the largest of their kind."""
        size = np.zeros(len(self.names))
        for s in self.subsystems:
            size[s.column_indices] = np.hypot(
                size[s.column_indices], np.linalg.norm(s.triangle.matrix, axis=0)
            )
        links = len(LINK_PARAMETERS) * self.observation.model.n
        kinds = [name.rpartition(".")[2] for name in self.names]
        largest: dict[str, float] = {}
        for kind, norm in zip(kinds, size, strict=True):
            largest[kind] = max(largest.get(kind, 0.0), norm)
        drives = list(zip(self.names, kinds, size, strict=True))[links:]
        return tuple(name for name, kind, norm in drives if norm <= _SILENT * largest[kind])

    def noise(self) -> list[tuple[float, int]]:
        """Noise σ̂ of every subsystem from its own fit, by rows less rank (Eq. 2.28), and that rank; NaN without more rows.

        Base parameters alone are fitted, and a column counts by its size at all joints: at one of them it may be the URDF's rounding.
        """
        sizes = np.zeros(len(self.names))
        for s in self.subsystems:
            sizes[s.column_indices] += np.sum(s.triangle.matrix**2, axis=0)
        scale = 1.0 / np.sqrt(np.where(sizes > 0, sizes, 1.0))
        kept = set(self.base.identifiability.kept)
        levels = []
        for s in self.subsystems:
            columns = np.array([i for i, number in enumerate(s.column_indices) if number in kept])
            levels.append(s.triangle.part(columns).noise(scale[s.column_indices[columns]]))
        return levels

    def errors(self, parameters: np.ndarray) -> tuple[float, np.ndarray]:
        """Relative residual ‖Y − W χ‖ / ‖Y‖ for `parameters` (p,): of all driven equations stacked, and of each of the observation's.

        Where nobody drives, what the links ask stands for Y.
        """
        missed, size = np.zeros((2, len(self.observation.labels)))
        driven = np.ones(len(missed), dtype=bool)
        for s in self.subsystems:
            missed[s.equation] += s.triangle.residual(parameters[s.column_indices]) ** 2
            asked = s.triangle.right
            if s.undriven:
                driven[s.equation] = False
                links = s.column_indices < len(LINK_PARAMETERS) * self.observation.model.n
                asked = s.triangle.matrix[:, links] @ parameters[s.column_indices[links]]
            size[s.equation] += np.sum(asked**2)
        return math.sqrt(missed[driven].sum() / size[driven].sum()), np.sqrt(
            missed / np.where(size > 0, size, 1.0)
        )

    @classmethod
    def of(
        cls, observation: Equations, base: BaseParameters, systems: Sequence[ExperimentSystem]
    ) -> RegressionData:
        """Systems of several experiments together."""
        subsystems = [
            Subsystem(
                equation, number, column_indices, _merged(system, equation), equation in observation.undriven
            )
            for number, system in enumerate(systems)
            for equation, column_indices in enumerate(observation.column_indices)
        ]
        masked = sum(system.masked for system in systems)
        return cls(observation, base, tuple(subsystems), masked, tuple(system.batches for system in systems))


def assemble_regression(
    observation: Equations,
    base: BaseParameters,
    experiments: Sequence[Experiment],
    decimation: Decimation,
    *,
    mask_standstill: bool = True,
    windows: Sequence[Window] | None = None,
) -> RegressionData:
    """Regression system of several experiments, in one pass over each.

    `windows` (one an experiment) restrict the rows that are kept. With `mask_standstill` rows at which all joints stand still are left
    out. Raises `FlexcalError` as `experiment_system` does.
    """
    chosen = [Window()] * len(experiments) if windows is None else windows
    batches = batches_each(len(experiments))
    systems = [
        experiment_system(
            observation, experiment, decimation, window, mask_standstill=mask_standstill, batches=batches
        )
        for experiment, window in zip(experiments, chosen, strict=True)
    ]
    return RegressionData.of(observation, base, systems)


def batches_each(experiments: int) -> int:
    """Largest number of batches per experiment, so that memory hardly grows with their number."""
    return max(1, min(BATCHES, _ALL_BATCHES // max(1, experiments)))


def _merged(system: ExperimentSystem, equation: int) -> TriangularFactor:
    factor = reduced([batch.factors[equation] for batch in system.batches])
    return TriangularFactor.padded(factor, sum(batch.rows for batch in system.batches))
