"""Logs of a robot, divided into a fitted and a held-out part."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flexcal.dynamics.diagnostics import TorquePrediction
from flexcal.dynamics.estimators import RecordedRows
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.regression import ExperimentSystem, batches_each
from flexcal.dynamics.signals import JointLog, Window
from flexcal.estimation import Estimate
from flexcal.jobs.logs.checks import require_joint_torques, require_unloaded, require_wrenches
from flexcal.jobs.logs.preprocessing import Preprocessing
from flexcal.jobs.logs.regression_systems import (
    LogSegment,
    assemble_joined_systems,
    assemble_log_systems,
    split_hold_out,
    with_progress,
)
from flexcal.jobs.logs.torque_predictions import predict_log_torques
from flexcal.jobs.logs.worker_logs import read_logs
from flexcal.model.robot import RobotModel
from flexcal.parallel import Workers
from flexcal.progress import Progress

MOST_EXPERIMENTS = 128
"""Number of logs above which they may be joined, to so many groups."""


@dataclass(frozen=True, eq=False)
class HoldOutLogs:
    """Logs, filtered, with their `fitted` and `unseen` parts, and the time in s `borders` between both in each log.

    Equations are made by the `workers`. Where `joined`, very many logs count as groups of consecutive ones, each a single experiment, so
    that what is kept does not grow with their number: the noise of a joint is then that of a group.
    """

    logs: tuple[JointLog, ...]
    borders: tuple[float, ...]
    fitted: tuple[LogSegment, ...]
    unseen: tuple[LogSegment, ...]
    preprocessing: Preprocessing
    joined: bool
    workers: Workers
    progress: Progress

    @classmethod
    def read(
        cls,
        fit: Sequence[Path],
        validate: Sequence[Path],
        hold_out: float,
        model: RobotModel,
        preprocessing: Preprocessing,
        scratch: Path,
        *,
        accept_weight: bool = False,
        joined: bool = False,
        workers: Workers,
        progress: Progress,
    ) -> HoldOutLogs:
        """Split the last share `hold_out` of the time of every log to `fit` off as unseen, together with the logs `validate`.

        Filtered logs are files of the folder `scratch`. Raises `InputError` and `FlexcalError` for a log that lies, has a payload, or
        has the torques of motors without a map, unless they are to be accepted (`accept_weight`).
        """
        seen, others = (
            read_logs(paths, model, preprocessing, scratch, workers=workers) for paths in (fit, validate)
        )
        require_unloaded([*seen, *others], model)
        if not accept_weight:
            require_joint_torques([*seen, *others], model)
        require_wrenches([*seen, *others], model)
        windows = [split_hold_out(log, preprocessing, hold_out) for log in seen]
        late = [LogSegment(log, w) for log, (_, w) in zip(seen, windows, strict=True) if w is not None]
        borders = [math.inf if w is None else w.start for _, w in windows]
        return cls(
            (*seen, *others),
            (*borders, *(-math.inf for _ in others)),
            tuple(LogSegment(log, early) for log, (early, _) in zip(seen, windows, strict=True)),
            (*late, *(LogSegment(log, Window()) for log in others)),
            preprocessing,
            joined,
            workers,
            progress,
        )

    def equations(self, observation: Observation) -> list[ExperimentSystem]:
        """Equations of the fitted part."""
        return self._systems(self.fitted, observation, batches_each(len(self.fitted)))

    def unseen_equations(self, observation: Observation) -> list[ExperimentSystem]:
        """Equations of the held-out part."""
        return self._systems(self.unseen, observation, 1)

    def rows(self, observation: Observation, base: BaseParameters) -> RecordedRows:
        """Rows of the fitted part, log after log in this process; every pass reports its progress."""
        return self._rows(self.fitted, observation, base)

    def unseen_rows(self, observation: Observation, base: BaseParameters) -> RecordedRows | None:
        """Rows of the held-out part, if any."""
        return self._rows(self.unseen, observation, base) if self.unseen else None

    def predictions(self, observation: Observation, estimate: Estimate) -> list[TorquePrediction]:
        """Torque predictions of all logs, for the report."""
        predicted = [(observation, estimate.parameters.coordinates())] * len(self.logs)
        return predict_log_torques(
            self.logs,
            self.borders,
            predicted,
            self.preprocessing,
            workers=self.workers,
            progress=self.progress,
        )

    def _systems(
        self, parts: Sequence[LogSegment], observation: Observation, batches: int
    ) -> list[ExperimentSystem]:
        if self.joined and len(parts) > MOST_EXPERIMENTS:
            return assemble_joined_systems(
                parts,
                observation,
                self.preprocessing,
                most=MOST_EXPERIMENTS,
                workers=self.workers,
                progress=self.progress,
            )
        return assemble_log_systems(
            parts,
            observation,
            self.preprocessing,
            batches=batches,
            workers=self.workers,
            progress=self.progress,
        )

    def _rows(
        self, parts: Sequence[LogSegment], observation: Observation, base: BaseParameters
    ) -> RecordedRows:
        logs = [part.log for part in with_progress(parts, "estimating", self.progress)]
        windows = [part.window for part in parts]
        preprocessing = self.preprocessing
        return RecordedRows(
            observation, base, logs, windows, preprocessing.decimation, preprocessing.mask_standstill
        )
