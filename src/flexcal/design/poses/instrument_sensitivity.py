"""Sensitivity of poses to geometric errors as another instrument than a tracker of points reads them."""

from __future__ import annotations

import numpy as np

from flexcal.design.poses.geometry_sensitivity import TYPICAL, GeometricTolerances, geometry_jacobian
from flexcal.design.poses.instruments import declared_instrument
from flexcal.design.scene import STANDARD, MeasuringSetup
from flexcal.estimation import Parameter, Parameters, Sensitivity
from flexcal.model.robot import RobotModel, unit_of


def instrument_sensitivity(
    model: RobotModel,
    q: np.ndarray,
    setup: MeasuringSetup = STANDARD,
    tolerances: GeometricTolerances = TYPICAL,
) -> Sensitivity:
    """Rows of every pose of `q` (samples, n) in the geometric errors and the instrument's place (SI), whitened by its noise.

    As `pose_sensitivity`, for the instrument `setup.measure`. Raises `FlexcalError` as `declared_instrument` does.
    """
    instrument = declared_instrument(model, str(setup.measure))
    target = model.point(setup.point).name
    station = f"station.{model.stations.names[0]}."
    names = [
        name
        for name in geometry_jacobian(model, q[:1], setup)[0]
        if instrument.tells_base or not name.startswith(station)
    ]
    stds = {name: tolerances.of(model, name) for name in names} | instrument.nuisances(target)
    rows = instrument.rows(instrument.placed(model, target), q, target, tuple(stds))
    parameters = Parameters(Parameter(name, unit_of(name), 0.0, prior_std=std) for name, std in stds.items())
    seen = np.abs(rows).max(axis=(0, 2)) > 0
    return Sensitivity(rows[:, seen], parameters, parameters.prior_information())
