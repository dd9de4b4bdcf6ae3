"""What the identified robot predicts for every log, for the report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from flexcal.dynamics import JointLog, Observation, TorquePrediction, predict_torques
from flexcal.estimation import Estimate
from flexcal.progress import Progress
from flexcal.workflow.log_systems import split
from flexcal.workflow.treatment import Treatment

_POINTS = 6000
"""Points of each joint in all logs together, about: what a page can carry."""
_FEWEST = 300
"""Points of each joint in one log, at least."""


def log_predictions(
    logs: Sequence[Path],
    validate: Sequence[Path],
    observation: Observation,
    estimate: Estimate,
    treatment: Treatment,
    *,
    hold_out: float,
    progress: Progress,
) -> list[TorquePrediction]:
    """Those of the logs of the fit, of which the last share `hold_out` was kept apart, then those of the logs that it never saw."""
    parameters = estimate.parameters.coordinates()
    count = len(logs) + len(validate)
    points = max(_FEWEST, _POINTS // count)
    found = []
    progress("report", 0.0)
    for number, path in enumerate([*logs, *validate], 1):
        log = JointLog(path, observation.model, treatment.cutoff_hz)
        border = -math.inf
        if number <= len(logs):
            late = split(log, treatment, hold_out)[1]
            border = math.inf if late is None else late.start
        found.append(
            predict_torques(
                observation,
                parameters,
                log,
                treatment.decimation,
                held_out_from=border,
                points=points,
            )
        )
        progress("report", number / count)
    return found
