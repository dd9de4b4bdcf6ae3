"""Joint logs to the equations that the estimators need, one after the other or in several processes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal.dynamics import ExperimentSystem, JointLog, Motion, Observation, Window, experiment_system
from flexcal.progress import Progress, silent
from flexcal.workflow.treatment import Treatment


@dataclass(frozen=True, eq=False)
class LogSystem:
    """The equations of one log: those of the fit, and those of its last part, where that is held out."""

    early: ExperimentSystem
    late: ExperimentSystem | None


def log_systems(
    logs: Sequence[Path],
    observation: Observation,
    treatment: Treatment,
    *,
    hold_out: float,
    batches: int,
    jobs: int,
    progress: Progress,
) -> list[LogSystem]:
    """The equations of every log, in their order, whatever the number of `jobs` (processes) is.

    The last share `hold_out` of the time of every log is kept apart, by what the filters reach over. Each log has at most about so many
    `batches`. Raises `InputError` and `FlexcalError` as `JointLog` and `experiment_system` do.
    """
    if jobs == 1:
        return [
            _log_system(log, observation, treatment, hold_out, batches, _onward(progress, number, len(logs)))
            for number, log in enumerate(logs)
        ]
    from joblib import Parallel, delayed

    parts = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(_log_system)(log, observation, treatment, hold_out, batches, silent) for log in logs
    )
    progress("reading", 0.0)
    found = []
    for part in parts:
        found.append(part)
        progress("reading", len(found) / len(logs))
    return found


def _onward(progress: Progress, number: int, logs: int) -> Progress:
    """Tells how much of all logs is done from how much of this one is; a second pass over it takes nothing back."""
    reached = number / logs

    def within(stage: str, share: float) -> None:
        nonlocal reached
        reached = max(reached, (number + share) / logs)
        progress(stage, reached)

    return within


def _log_system(
    log: Path,
    observation: Observation,
    treatment: Treatment,
    hold_out: float,
    batches: int,
    progress: Progress,
) -> LogSystem:
    experiment = _Watched(log, observation.model, treatment.cutoff_hz, progress)
    progress("reading", 0.0)
    early, late = Window(), None
    if hold_out > 0:
        split = held_out_from(experiment, hold_out)
        reach = treatment.decimation.support * experiment.time_step
        early, late = Window(end=float(np.nextafter(split - reach, -math.inf))), Window(start=split)

    def system(window: Window, batches: int) -> ExperimentSystem:
        return experiment_system(
            observation,
            experiment,
            treatment.decimation,
            window,
            mask_standstill=treatment.mask_standstill,
            batches=batches,
        )

    found = LogSystem(system(early, batches), None if late is None else system(late, 1))
    progress("reading", 1.0)
    return found


def held_out_from(log: JointLog, share: float) -> float:
    """When the last `share` of the time of a log begins, s on its clock."""
    start, end = log.span
    return end - share * (end - start)


@dataclass(frozen=True, eq=False)
class _Watched(JointLog):
    """A log that says how much of it is read."""

    progress: Progress

    def blocks(self) -> Iterator[Motion]:
        seen = 0
        for motion in super().blocks():
            yield motion
            seen += len(motion)
            self.progress("reading", min(1.0, seen / max(1, self.samples)))
