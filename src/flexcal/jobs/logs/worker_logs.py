"""Joint logs where the workers are: filtered once, and again where another machine does not have the filtered file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from flexcal.dynamics.signals import JointLog
from flexcal.jobs.logs.preprocessing import Preprocessing
from flexcal.jobs.logs.scratch import scratch_folder
from flexcal.jobs.logs.worker_files import worker_paths
from flexcal.model.robot import RobotModel
from flexcal.parallel import Workers


def read_logs(
    paths: Sequence[Path], model: RobotModel, preprocessing: Preprocessing, scratch: Path, *, workers: Workers
) -> list[JointLog]:
    """Logs filtered into files of the folder `scratch`, by the `workers`; one that does not see that folder keeps no file.

    Raises `InputError` and `FlexcalError` as `JointLog.read` does.
    """
    there = worker_paths(paths, workers)
    read = workers.values(_read, there, model, preprocessing.cutoff_hz, scratch)
    return [replace(log, path=path) for log, path in zip(read, paths, strict=True)]


@contextmanager
def present_log(log: JointLog, model: RobotModel) -> Iterator[JointLog]:
    """The log with its filtered file on this machine, where need be filtered again for this block."""
    if log.filtered.exists():
        yield log
        return
    with scratch_folder() as folder:
        yield replace(log, filtered=JointLog.read(log.path, model, log.cutoff_hz, folder).filtered)


def _read(path: Path, model: RobotModel, cutoff_hz: float, scratch: Path) -> JointLog:
    if scratch.is_dir():
        return JointLog.read(path, model, cutoff_hz, scratch)
    with scratch_folder() as folder:
        return JointLog.read(path, model, cutoff_hz, folder)
