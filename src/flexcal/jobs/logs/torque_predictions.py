"""Predicted torques of every log, for the report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.dynamics.diagnostics import TorquePrediction, predict_torques
from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.signals import JointLog
from flexcal.jobs.logs.preprocessing import Preprocessing
from flexcal.progress import Progress

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
    progress: Progress,
) -> list[TorquePrediction]:
    """Predictions, one per log, unseen by the fit from the time `held_out_from` on, s; `predicted` has columns and parameters (p,) of
    each.
    """
    points = max(_FEWEST, _POINTS // len(logs))
    predictions = []
    progress("report", 0.0)
    for log, border, (observation, parameters) in zip(logs, held_out_from, predicted, strict=True):
        prediction = predict_torques(
            observation, parameters, log, preprocessing.decimation, held_out_from=border, points=points
        )
        predictions.append(prediction)
        progress("report", len(predictions) / len(logs))
    return predictions
