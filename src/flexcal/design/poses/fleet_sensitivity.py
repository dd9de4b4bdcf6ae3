"""Sensitivity of measured poses to what a calibration with a prior from other robots estimates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.calibration.fit import FleetPrior, plausible_size
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.design.poses.geometry_sensitivity import BLOCK, measuring_noise
from flexcal.design.scene import MeasuringSetup
from flexcal.estimation import Parameter, Parameters, Sensitivity
from flexcal.model.robot import STATION, RobotModel, unit_in


def fleet_parameters(model: RobotModel, fleet: FleetPrior, setup: MeasuringSetup) -> Parameters:
    """Place of instrument and target, which are the robot's own, and the parameters of the prior; their `prior_std` are plausible sizes."""
    target = model.point(setup.point).name
    first = target == model.tool_point
    place = [f"station.{setup.station or model.stations.names[0]}.{key}" for key in STATION]
    place += [f"tool.length_{axis}" if first else f"point.{target}.{axis}" for axis in "xyz"]
    return Parameters(
        Parameter(name, unit_in(model, name), 0.0, prior_std=plausible_size(model, name))
        for name in [*place, *fleet.names]
    )


def fleet_jacobian(
    model: RobotModel, q: np.ndarray, setup: MeasuringSetup, names: Sequence[str]
) -> np.ndarray:
    """Derivatives (samples, 3, p), m per natural unit, of the measured positions of poses `q` (samples, n) by parameters, compliances
    included.
    """
    station, target = setup.station or model.stations.names[0], model.point(setup.point).name
    rows = np.empty((len(q), 3, len(names)))
    for first in range(0, len(q), BLOCK):
        poses = PoseSet.unmeasured(q[first : first + BLOCK], target, station)
        if setup.payload is not None:
            poses = replace(poses, payload=np.full(len(poses), setup.payload))
        at = predict_measurements(model, poses, elastic=False, jacobians=True)
        rows[first : first + BLOCK] = at.jacobian(names)
    return rows


def fleet_sensitivity(
    model: RobotModel, q: np.ndarray, setup: MeasuringSetup, fleet: FleetPrior
) -> Sensitivity:
    """Rows of every pose of `q` (samples, n), whitened by the tracker's noise, in `fleet_parameters`; prior: their plausible sizes."""
    parameters = fleet_parameters(model, fleet, setup)
    rows = fleet_jacobian(model, q, setup, parameters.names) / measuring_noise(model, q, setup)[:, None, None]
    return Sensitivity(rows, parameters, parameters.prior_information())
