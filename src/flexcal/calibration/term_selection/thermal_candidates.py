"""Candidate terms of a measured temperature, and why they are left where it says too little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.fit import THERMAL, moving_joints, sensor_scatter, thermal_parameters
from flexcal.data.poses import PoseSet
from flexcal.model.robot import ZERO_DRIFT, RobotModel
from flexcal.model.statics import points_kinematics
from flexcal.units import MILLIMETRE

PRECISION = 5e-6
"""Standard deviation of the expansion coefficient, 1/K, beyond which it tells nothing: half of that of steel."""
_ABOVE_SENSOR = 3.0
"""Standard deviation of the temperatures over the scatter of their sensor, below which they are hardly told from it."""
_MICRO = 1e-6


@dataclass(frozen=True)
class ThermalCandidates:
    """Terms of temperature that may be added: `kinds`, those of `single` joints, or why there are none: (term, clause)."""

    kinds: tuple[str, ...] = ()
    single: tuple[str, ...] = ()
    excluded: tuple[tuple[str, str], ...] = ()


def thermal_candidates(model: RobotModel, poses: PoseSet, scatter: float) -> ThermalCandidates:
    """Terms of temperature to be considered on some poses, by what their temperatures can tell beside a `scatter`, m, of a coordinate."""
    if poses.temperature is None:
        return ThermalCandidates()
    reason = _weakness(model, poses, scatter)
    if reason:
        return ThermalCandidates(excluded=(("thermal", reason),))
    kinds = [kind for kind in THERMAL if kind != "thermal_links" or model.relations is None]
    names = thermal_parameters(model, poses, ZERO_DRIFT, moving_joints(model, poses))
    return ThermalCandidates(tuple(kinds), tuple(names))


def _weakness(model: RobotModel, poses: PoseSet, scatter: float) -> str:
    """Clause on why temperatures of the poses tell no expansion beside the scatter; empty where they may."""
    temperature = poses.temperature
    assert temperature is not None
    extent, spread = float(np.ptp(temperature)), float(temperature.std())
    if not extent > 0:
        return f"the temperature in the files is {temperature[0]:.1f} °C throughout"
    sensor = sensor_scatter(poses)
    if sensor is not None and spread < _ABOVE_SENSOR * sensor:
        return (
            f"the temperature varies by {spread:.2g} K (1σ), which is less than {_ABOVE_SENSOR:.0f} times the {sensor:.2g} K by which its "
            "sensor scatters"
        )
    std = scatter / (spread * _extent_of(model, poses) * np.sqrt(len(poses)))
    if std > PRECISION:
        return (
            f"the temperature varies by {extent:.2g} K only, from which an expansion coefficient would be known to "
            f"{std / _MICRO:.0f} µm/m/K (1σ) at the {scatter / MILLIMETRE:.2g} mm that points scatter with all other terms, and not to "
            f"{PRECISION / _MICRO:.0f}"
        )
    return ""


def _extent_of(model: RobotModel, poses: PoseSet) -> float:
    """Root mean square distance, m, of the points from their mean."""
    at = points_kinematics(model, poses.q, None, poses.target, jacobians=False).position
    return float(np.sqrt(((at - at.mean(axis=0)) ** 2).sum(axis=1).mean()))
