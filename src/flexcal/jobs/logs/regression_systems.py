"""Regression systems of joint logs, assembled where the workers are."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.regression import ExperimentSystem, experiment_system, joined_systems
from flexcal.dynamics.signals import JointLog, Window
from flexcal.jobs.logs.preprocessing import Preprocessing
from flexcal.jobs.logs.worker_files import worker_paths
from flexcal.jobs.logs.worker_logs import present_log
from flexcal.parallel import ThisProcess, Workers, consecutive_groups
from flexcal.progress import Progress

_STAGE = "reading"
_LEAST = 1e-6
"""Least fitted share of a log whose progress is reported."""


@dataclass(frozen=True, eq=False)
class LogSegment:
    """Part of a log within a time window."""

    log: JointLog
    window: Window


def assemble_log_systems(
    parts: Sequence[LogSegment],
    observation: Observation,
    preprocessing: Preprocessing,
    *,
    batches: int,
    workers: Workers,
    progress: Progress,
) -> list[ExperimentSystem]:
    """Regression systems of every part, in their order, independent of the `workers`.

    Each part has at most about so many `batches`. Raises `FlexcalError` as `experiment_system` does.
    """
    tasks = _tasks(parts, workers, progress)
    systems = workers.values(_log_system, tasks, observation, preprocessing, batches)
    return _reported(systems, len(parts), workers, progress)


def assemble_joined_systems(
    parts: Sequence[LogSegment],
    observation: Observation,
    preprocessing: Preprocessing,
    *,
    most: int,
    workers: Workers,
    progress: Progress,
) -> list[ExperimentSystem]:
    """Regression systems of at most `most` groups of consecutive parts, independent of the `workers`.

    Each group is one batch: a tree of `joined_systems`, which are the QR decomposition of tall and skinny matrices (TSQR; Demmel, Grigori,
    Hoemmen & Langou, SIAM J. Sci. Comput. 34, 2012). Raises `FlexcalError` as `experiment_system` does.
    """
    groups = consecutive_groups(_tasks(parts, workers, progress), most)
    systems = workers.reduced(_log_system, groups, joined_systems, observation, preprocessing, 1)
    return _reported(systems, len(groups), workers, progress)


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


def _tasks(parts: Sequence[LogSegment], workers: Workers, progress: Progress) -> list[LogSegment]:
    """Parts as the workers take them; in this process they report how far each is."""
    if isinstance(workers, ThisProcess):
        return with_progress(parts, _STAGE, progress)
    paths = worker_paths([part.log.path for part in parts], workers)
    return [replace(part, log=replace(part.log, path=path)) for part, path in zip(parts, paths, strict=True)]


def _reported(
    systems: Iterable[ExperimentSystem], count: int, workers: Workers, progress: Progress
) -> list[ExperimentSystem]:
    progress(_STAGE, 0.0)
    assembled = []
    for system in systems:
        assembled.append(system)
        if not isinstance(workers, ThisProcess):
            progress(_STAGE, len(assembled) / count)
    progress(_STAGE, 1.0)
    return assembled


def _log_system(
    part: LogSegment, observation: Observation, preprocessing: Preprocessing, batches: int
) -> ExperimentSystem:
    with present_log(part.log, observation.model) as log:
        return experiment_system(
            observation,
            log,
            preprocessing.decimation,
            part.window,
            mask_standstill=preprocessing.mask_standstill,
            batches=batches,
        )
