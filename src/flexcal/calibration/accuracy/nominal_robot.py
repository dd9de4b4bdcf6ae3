"""How far the uncalibrated robot is from the calibrated one."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.kinds import best_motion
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest

_BLOCK = 8192
_FEWEST = 4
"""Number of points below which a motion of the whole robot explains everything."""


def distance_to_nominal(
    model: RobotModel,
    nominal: RobotModel,
    q: np.ndarray,
    target: str,
    payload: float,
    temperature: float | None = None,
) -> np.ndarray | None:
    """Distance (N,), m, between a point of the calibrated robot `model` under `payload` kg and of the rigid `nominal` one at `q` (N, n).

    `temperature` in °C is the calibrated robot's, by default that at which its parameters hold.

    The nominal robot is placed by the rigid motion that fits best over all poses (Kabsch 1976), as an instrument would register it. None
    for fewer than four poses.
    """
    if len(q) < _FEWEST:
        return None
    real, expected = np.empty((len(q), 3)), np.empty((len(q), 3))
    for first in range(0, len(q), _BLOCK):
        rows = slice(first, first + _BLOCK)
        names, mass = np.full(len(q[rows]), target), np.full(len(q[rows]), payload)
        warm = None if temperature is None else np.full(len(q[rows]), temperature)
        real[rows] = tool_at_rest(model, q[rows], mass, names, temperature=warm).kinematics.position
        expected[rows] = tool_at_rest(nominal, q[rows], mass, names, elastic=False).kinematics.position
    rotation, translation = best_motion(expected, real)
    return np.linalg.norm(real - expected @ rotation.T - translation, axis=1)
