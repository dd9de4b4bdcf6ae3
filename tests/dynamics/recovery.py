"""What an estimator should find, and how far from it that is."""

from dataclasses import replace

import numpy as np

from flexcal.data.recordings import Decimation
from flexcal.dynamics.estimators import RecordedRows
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.signals import Motion, Window
from flexcal.estimation import Estimate

NOISE = np.array([3.0, 2.0, 1.0, 0.3, 0.2, 0.05])
"""Of the TX40's torques, N m: some per cent of each joint's."""


def driven(observation: Observation, motion: Motion, truth: np.ndarray) -> Motion:
    """The motion with the torques (N, n) of the true parameters (p,)."""
    parts = zip(observation.column_indices, observation.columns(motion), strict=True)
    return replace(motion, torque=np.stack([truth[m] @ c for m, c in parts], axis=1))


def recorded(observation: Observation, base: BaseParameters, *motions: Motion) -> RecordedRows:
    """All rows of the motions, not decimated."""
    return RecordedRows(observation, base, motions, [Window()] * len(motions), Decimation(1))


def errors(estimate: Estimate, observation: Observation, truth: np.ndarray) -> dict[str, float]:
    """Of the base parameters."""
    hidden = {entry.name for entry in estimate.dropped}
    expected = estimate.regrouped(dict(zip(observation.names, truth, strict=True)))
    return {name: estimate.values[name] - v for name, v in expected.items() if name not in hidden}


def covered(estimate: Estimate, missed: dict[str, float]) -> np.ndarray:
    """Which 95 % intervals hold the truth."""
    ends = np.array([estimate.interval(name) for name in missed])
    return np.abs(list(missed.values())) <= np.ptp(ends, axis=1) / 2
