"""Drive gains from recordings with and without a payload of known mass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.tables import mapped_signals
from flexcal.dynamics.drives import drive_gains
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import ExperimentSystem, RegressionData, batches_each
from flexcal.dynamics.signals import Window
from flexcal.errors import FlexcalError, InputError
from flexcal.estimation import Estimate
from flexcal.files.formats import provenance
from flexcal.jobs.inputs import require_distinct_files
from flexcal.jobs.logs import (
    LogSegment,
    assemble_log_systems,
    choose_preprocessing,
    payload_masses,
    preprocessing_document,
    read_logs,
    require_no_wrenches,
    scratch_folder,
)
from flexcal.jobs.result_files import RunRecord, header, quantities, write_results
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, gain_checks
from flexcal.report.results import ParameterChanges, parameter_changes


@dataclass(frozen=True)
class SplitHalfGains:
    """Factors of the gains from each half alone, and how they differ."""

    changes: ParameterChanges

    def document(self) -> dict[str, Any]:
        """The block `halves` of results.json."""
        return {
            "probability": self.changes.probability,
            "factors": {
                change.name: {"first": change.values[0], "second": change.values[1], "score": change.score}
                for change in self.changes.changes
            },
        }


def half_gains(
    observation: Observation,
    base: BaseParameters,
    systems: Sequence[ExperimentSystem],
    payloads: Sequence[float],
) -> SplitHalfGains | None:
    """`drive_gains` from the first and the second half of every recording; None where a half alone does not determine them."""
    if min(len(system.batches) for system in systems) < 2:
        return None
    halves = zip(*(_halves(system) for system in systems), strict=True)
    try:
        first, second = (drive_gains(RegressionData.of(observation, base, half), payloads) for half in halves)
    except FlexcalError:
        return None
    changes = parameter_changes(first, second)
    return SplitHalfGains(changes) if changes.changes else None


def _halves(system: ExperimentSystem) -> tuple[ExperimentSystem, ExperimentSystem]:
    middle = len(system.batches) // 2
    return replace(system, batches=system.batches[:middle]), replace(system, batches=system.batches[middle:])


@dataclass(frozen=True, eq=False)
class IdentifiedGains:
    """Drive gains: `factors` to the `declared` gains (n,) of `signals: tau:`, which are 1 where there are none.

    `halves` are the factors from each half of the recordings, None where a half alone does not determine them. `payloads` are kg by log,
    `signals` as `preprocessing_document` has them; `record` says what they come from.
    """

    factors: Estimate
    halves: SplitHalfGains | None
    declared: np.ndarray
    payloads: tuple[float, ...]
    signals: Mapping[str, Any]
    robot: str
    record: RunRecord

    @property
    def gains(self) -> list[float]:
        """Declared gains times factors (n,); as declared where the recordings do not determine the factor."""
        factors = zip(
            self.declared, self.factors.parameters.coordinates(), self.factors.identifiable, strict=True
        )
        return [float(gain * factor) if told else float(gain) for gain, factor, told in factors]

    @property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(gain_checks(quantities(self.factors), self._halves))

    @property
    def _halves(self) -> dict[str, Any] | None:
        return None if self.halves is None else self.halves.document()

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {
            **header("gains"),
            "robot": self.robot,
            "parameters": quantities(self.factors),
            "halves": self._halves,
            "verdict": self.trust.document(),
            "declared_gains": list(self.declared),
            "gains": self.gains,
            "signals": dict(self.signals),
            "payloads_kg": list(self.payloads),
            **self.record.document(),
        }


def identify_gains(
    robot: Path,
    logs: Sequence[Path],
    *,
    out: Path | None = None,
    command: str = "",
    jobs: int = 1,
    progress: Progress = silent,
) -> IdentifiedGains:
    """Drive gains of a robot.yaml from joint logs with and without its payload, whose mass alone is taken as known.

    Friction is the classic one. With `out`, results.json and report.html go to that folder; robot.yaml stays as it is. Raises
    `FlexcalError` where the logs do not fit the robot, a matrix of `signals:` mixes the torques of several columns, a log does not say
    whether the payload was held, and as `drive_gains` does.
    """
    require_distinct_files(logs)
    model = RobotModel.from_yaml(robot, estimates=False)
    declared = _declared(model)
    treatment = choose_preprocessing(model, logs)
    observation = Observation(model, CLASSIC)
    with scratch_folder() as folder:
        read = read_logs(logs, model, treatment, folder, jobs=jobs)
        payloads = payload_masses(read, model)
        require_no_wrenches(read)
        parts = [LogSegment(log, Window()) for log in read]
        systems = assemble_log_systems(
            parts, observation, treatment, batches=batches_each(len(logs)), jobs=jobs, progress=progress
        )
    base = BaseParameters.of(observation)
    result = IdentifiedGains(
        drive_gains(RegressionData.of(observation, base, systems), payloads),
        half_gains(observation, base, systems, payloads),
        declared,
        tuple(payloads),
        preprocessing_document(treatment, read),
        model.name,
        RunRecord(provenance([robot, model.urdf, *logs]), command),
    )
    if out is not None:
        from flexcal.jobs.pages import report_folder

        write_results(out, result.document())
        report_folder(out)
    return result


def _declared(model: RobotModel) -> np.ndarray:
    """Gains (n,) of `signals: tau:`, one a joint."""
    config, mapped = model.config.signals.get("tau"), mapped_signals(model).get("tau")
    matrix = None if mapped is None else mapped.matrix
    if matrix is not None and (
        matrix.shape != (model.n, model.n) or np.any(matrix != np.diag(np.diag(matrix)))
    ):
        raise InputError(
            "E-RUN-032",
            f"{model.path}: the matrix of signals.tau mixes columns, but drive gains need one column per joint.",
        )
    return np.ones(model.n) if config is None or config.gain is None else np.array(config.gain)
