"""Predicted torques of every log, for the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.dynamics.diagnostics import TorquePrediction, predict_torques
from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.signals import JointLog
from flexcal.jobs.logs.preprocessing import Preprocessing
from flexcal.jobs.logs.worker_files import worker_paths
from flexcal.jobs.logs.worker_logs import present_log
from flexcal.parallel import ThisProcess, Workers
from flexcal.progress import Progress

_HERE = ThisProcess()
_POINTS = 6000
"""Approximate number of points of each joint in all logs together that a page can hold."""
_FEWEST = 300
"""Least number of points of each joint in one log."""


def predict_log_torques(
    logs: Sequence[JointLog],
    held_out_from: Sequence[float],
    predicted: Sequence[tuple[Observation, np.ndarray]],
    preprocessing: Preprocessing,
    *,
    workers: Workers = _HERE,
    progress: Progress,
) -> list[TorquePrediction]:
    """Predictions, one per log, unseen by the fit from the time `held_out_from` on, s; `predicted` has columns and parameters (p,) of
    each.
    """
    points = max(_FEWEST, _POINTS // len(logs))
    paths = worker_paths([log.path for log in logs], workers)
    there = [replace(log, path=path) for log, path in zip(logs, paths, strict=True)]
    tasks = zip(there, held_out_from, predicted, strict=True)
    predictions = []
    progress("report", 0.0)
    for prediction in workers.values(_predicted, tasks, preprocessing, points):
        predictions.append(prediction)
        progress("report", len(predictions) / len(logs))
    return predictions


def _predicted(
    task: tuple[JointLog, float, tuple[Observation, np.ndarray]], preprocessing: Preprocessing, points: int
) -> TorquePrediction:
    given, border, (observation, parameters) = task
    with present_log(given, observation.model) as log:
        return predict_torques(
            observation, parameters, log, preprocessing.decimation, held_out_from=border, points=points
        )
