"""Regression systems of joint logs, assembled one after the other or in several processes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.regression import ExperimentSystem, experiment_system
from flexcal.dynamics.signals import JointLog, Window
from flexcal.jobs.logs.preprocessing import Preprocessing
from flexcal.model.robot import RobotModel
from flexcal.parallel import WorkerTask, start_workers
from flexcal.progress import Progress

_LEAST = 1e-6
"""Least fitted share of a log whose progress is reported."""


@dataclass(frozen=True, eq=False)
class LogSegment:
    """Part of a log within a time window."""

    log: JointLog
    window: Window


def read_logs(
    paths: Sequence[Path], model: RobotModel, preprocessing: Preprocessing, scratch: Path, *, jobs: int
) -> list[JointLog]:
    """Logs filtered into files of the folder `scratch`, by `jobs` processes in parallel.

    Raises `InputError` and `FlexcalError` as `JointLog.read` does.
    """
    if jobs == 1:
        return [JointLog.read(path, model, preprocessing.cutoff_hz, scratch) for path in paths]
    from joblib import Parallel, delayed

    start_workers(jobs)
    read: Any = Parallel(n_jobs=jobs)(
        delayed(WorkerTask(JointLog.read))(path, model, preprocessing.cutoff_hz, scratch) for path in paths
    )
    return read


def assemble_log_systems(
    parts: Sequence[LogSegment],
    observation: Observation,
    preprocessing: Preprocessing,
    *,
    batches: int,
    jobs: int,
    progress: Progress,
) -> list[ExperimentSystem]:
    """Regression systems of every part, in their order, independent of the number of processes `jobs`.

    Each part has at most about so many `batches`. Raises `FlexcalError` as `experiment_system` does.
    """
    if jobs == 1:
        progress("reading", 0.0)
        assembled = [
            _log_system(part, observation, preprocessing, batches)
            for part in with_progress(parts, "reading", progress)
        ]
        progress("reading", 1.0)
        return assembled
    from joblib import Parallel, delayed

    systems = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(WorkerTask(_log_system))(part, observation, preprocessing, batches) for part in parts
    )
    progress("reading", 0.0)
    assembled = []
    for system in systems:
        assembled.append(system)
        progress("reading", len(assembled) / len(parts))
    return assembled


def split_hold_out(
    log: JointLog, preprocessing: Preprocessing, hold_out: float
) -> tuple[Window, Window | None]:
    """Fitted part of a log, and its last share `hold_out` of time, if any; the filters of neither reach into the other."""
    if hold_out == 0:
        return Window(), None
    border = log.last(hold_out)
    reach = preprocessing.decimation.support * log.time_step
    return Window(end=float(np.nextafter(border - reach, -math.inf))), Window(start=border)


def with_progress(parts: Sequence[LogSegment], stage: str, progress: Progress) -> list[LogSegment]:
    """Iterable over the parts that reports every complete pass to `progress` as a `stage`."""

    def told(number: int, until: float) -> Callable[[float], None]:
        return lambda share: progress(stage, (number + min(1.0, share / until)) / len(parts))

    watched_parts = []
    for number, part in enumerate(parts):
        start, end = part.log.span
        until = max((min(end, part.window.end) - start) / (end - start), _LEAST)
        watched_parts.append(replace(part, log=replace(part.log, watch=told(number, until))))
    return watched_parts


def _log_system(
    part: LogSegment, observation: Observation, preprocessing: Preprocessing, batches: int
) -> ExperimentSystem:
    return experiment_system(
        observation,
        part.log,
        preprocessing.decimation,
        part.window,
        mask_standstill=preprocessing.mask_standstill,
        batches=batches,
    )
