"""Sensors on the arm whose sensitivity varies with frequency."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.model.robot import ArmSensor
from flexcal.model.vibration.motor_impedance import KNOT_OCTAVES, over_frequency


def sensitivity_response_change(
    response: np.ndarray,
    frequencies_hz: np.ndarray,
    sensors: Sequence[ArmSensor],
    *,
    every: Sequence[str],
    grid: np.ndarray,
    octave: float = KNOT_OCTAVES,
) -> np.ndarray:
    """∂G (L, E + S, E, k) by the departures of the sensors named `every` at knots each `octave` of the lines `grid`, one standard deviation
    of each, real and imaginary.

    `response` (L, E + S, E) is that of the E axes and then of the S `sensors` at `frequencies_hz` (L,), which are among those of `grid`.
    """
    lines = np.unique(grid)
    knots = over_frequency(np.ones((len(lines), 1, 1, 1)), lines, octave)[:, 0, 0]
    at = knots[np.searchsorted(lines, frequencies_hz)]
    axes = response.shape[2]
    change = np.zeros((*response.shape, len(every), at.shape[1]), dtype=complex)
    for row, sensor in enumerate(sensors, start=axes):
        departed = sensor.config.flatness_std * response[:, row, :, None] * at[:, None]
        change[:, row, :, every.index(sensor.name)] = departed
    return change.reshape(*response.shape, -1)
