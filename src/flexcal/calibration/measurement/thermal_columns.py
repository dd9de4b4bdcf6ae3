"""Derivatives of readings by expansion coefficients and by drifts with temperature."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.model.kinematics import (
    Ends,
    carrier_ends,
    link_vectors,
    point_ends,
    relative_motion,
    temperature_rise,
)
from flexcal.model.robot import EXPANSION, STATION_DRIFT, RobotModel

if TYPE_CHECKING:
    from flexcal.calibration.measurement.prediction import PredictedMeasurements


def rise_of(at: PredictedMeasurements) -> np.ndarray:
    """Temperature (N,) of the poses above that of the parameters, K; zero where none was measured."""
    temperature = at.poses.temperature
    return np.zeros(len(at.poses)) if temperature is None else temperature_rise(at.model, temperature)


def expansion_column(at: PredictedMeasurements, name: str) -> np.ndarray:
    """Derivative (R, 3) of the readings by the expansion coefficient of the arm, or by what that of a link is beyond it."""
    model, poses, rise = at.model, at.poses, rise_of(at)
    ends = point_ends(model, poses.target)
    moved = _grown(model, poses.q, at.target.position, poses.target, ends, rise, name)
    if at.carrier is not None:
        carried = _grown(model, poses.q, at.carrier.position, poses.station, carrier_ends(model), rise, name)
        moved = relative_motion(at.target, at.carrier, moved, carried)
    return at.moved(moved)[:, :, 0]


def station_drift_column(at: PredictedMeasurements, name: str) -> np.ndarray:
    """Derivative (R, 3) of the readings by the shift of one coordinate of a station per kelvin."""
    station, _, key = name.removeprefix("station.").rpartition(".")
    shift = np.zeros((len(at.poses), 3))
    shift[:, STATION_DRIFT.index(key)] = np.where(at.poses.station == station, rise_of(at), 0.0)
    column = np.zeros((len(at.readings.row), 3))
    column[: len(at.poses)] = at.displaced(shift)
    return column


def _grown(
    model: RobotModel,
    q: np.ndarray,
    position: np.ndarray,
    names: np.ndarray,
    ends: Ends,
    rise: np.ndarray,
    name: str,
) -> np.ndarray:
    """Motion (N, 6, 1) of points at `position` (N, 3), by their `names` (N,), by an expansion coefficient."""
    moved = np.zeros((len(q), 6, 1))
    if name == EXPANSION:
        moved[:, :3, 0] = (rise / (1 + model.thermal.expansion[0] * rise))[:, None] * position
        return moved
    link = [joint.link for joint in model.joints].index(name.rpartition(".")[0])
    for one, end in ends.items():
        own = names == one
        moved[own, :3, 0] = rise[own, None] * link_vectors(model, q[own], end)[:, link]
    return moved
