"""Rows of all experiments, for estimators that need single rows in several passes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.recordings import Decimation
from flexcal.dynamics.inverse_model import BaseParameters, Equations, Observation
from flexcal.dynamics.regression import (
    ExperimentSystem,
    RegressionBlock,
    RegressionData,
    batch_length,
    batched,
    batches_each,
    experiment_system,
    regression_blocks,
)
from flexcal.dynamics.signals import Experiment, Window
from flexcal.dynamics.simulation import SimulatedExperiment
from flexcal.errors import FlexcalError

_Join = Callable[[RegressionBlock, RegressionBlock], RegressionBlock]
"""Function that combines the same rows as recorded and as simulated."""


@dataclass(frozen=True, eq=False)
class RecordedRows:
    """Rows of a fit; every method is one pass over all `experiments`, each with a window.

    Of the rows that are kept between passes only one number a row and equation stays in memory.
    """

    observation: Observation
    base: BaseParameters
    experiments: Sequence[Experiment]
    windows: Sequence[Window]
    decimation: Decimation
    mask_standstill: bool = True

    def residuals(self, parameters: np.ndarray) -> list[np.ndarray]:
        """Y − W χ (equations, rows), N m, of every experiment at `parameters` (p,), NaN for rows that are left out."""
        by_experiment = []
        for experiment, window in zip(self.experiments, self.windows, strict=True):
            count = experiment.samples // self.decimation.factor + 1
            missed = np.full((len(self.observation.labels), count), np.nan)
            for block in regression_blocks(self.observation, experiment, self.decimation, window):
                part = block.where(~block.still) if self.mask_standstill else block
                missed[:, part.number] = part.torque - part.predicted(
                    self.observation.column_indices, parameters
                )
            by_experiment.append(missed)
        return by_experiment

    def weighted(self, weights: Sequence[np.ndarray]) -> RegressionData:
        """Equations multiplied by the roots of their weights: (equations, rows) per experiment, as `residuals`."""
        return self._data(self.observation, weights)

    def observed_as(self, equations: Equations) -> RegressionData:
        """Rows of other equations for the same samples."""
        return self._data(equations, [None] * len(self.experiments))

    def _data(self, equations: Equations, weights: Sequence[np.ndarray | None]) -> RegressionData:
        batches = batches_each(len(self.experiments))
        systems = [
            experiment_system(
                equations,
                experiment,
                self.decimation,
                window,
                mask_standstill=self.mask_standstill,
                batches=batches,
                weights=own,
            )
            for experiment, window, own in zip(self.experiments, self.windows, weights, strict=True)
        ]
        return RegressionData.of(equations, self.base, systems)

    def simulated(self, parameters: np.ndarray) -> RegressionData:
        """Equations with the observation matrix of the closed loop simulated with `parameters` (p,), and the measured torques.

        Raises `FlexcalError` as `SimulatedExperiment` does.
        """
        systems = self._simulated(
            parameters, lambda measured, simulated: replace(simulated, still=measured.still)
        )
        return RegressionData.of(self.observation, self.base, systems)

    def instrumented(self, parameters: np.ndarray) -> list[ExperimentSystem]:
        """Equations with the instruments before W: every joint's columns are [Z, W, Y], twice its column indices and one.

        Z is the observation matrix of the simulated closed loop with `parameters` (p,), through the filters of W, at the same rows.
        Raises `FlexcalError` as `SimulatedExperiment` does.
        """
        return self._simulated(parameters, _beside)

    def _simulated(self, parameters: np.ndarray, join: _Join) -> list[ExperimentSystem]:
        batches = batches_each(len(self.experiments))
        return [
            batched(
                self._following(experiment, window, parameters, join),
                experiment.name,
                batch_length(experiment, self.decimation, batches),
                mask_standstill=self.mask_standstill,
            )
            for experiment, window in zip(self.experiments, self.windows, strict=True)
        ]

    def _following(
        self,
        experiment: Experiment,
        window: Window,
        parameters: np.ndarray,
        join: _Join,
    ) -> Iterator[RegressionBlock]:
        """Rows joined from the measured and the simulated ones, where the simulation is reliable."""
        simulated = SimulatedExperiment(self.observation, parameters, experiment, self.decimation)
        pairs = (
            regression_blocks(self.observation, e, self.decimation, window) for e in (experiment, simulated)
        )
        empty = True
        for measured, model in zip(*pairs, strict=True):
            joined = join(measured, model).where(simulated.reliable(measured.time))
            if len(joined):
                empty = False
                yield joined
        if empty:
            raise FlexcalError(
                "E-DYN-010",
                f"{experiment.name}: it is too short, or its parts between gaps are, for the simulation that this estimator needs; use "
                "--estimator wls, or record it without gaps.",
            )


def _beside(measured: RegressionBlock, simulated: RegressionBlock) -> RegressionBlock:
    """Measured rows with the simulated columns in front."""
    pairs = zip(measured.reduced, simulated.reduced, strict=True)
    return replace(
        measured,
        reduced=[np.vstack([instruments[:-1], own]) for own, instruments in pairs],
        projection=tuple(np.kron(np.eye(2), own) for own in measured.projection),
    )
