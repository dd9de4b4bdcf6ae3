"""Errors of the uncalibrated robot: as declared, best-fit registered, and with the measured point fitted too.

A reflector whose place on the tool was taken with a ruler is off by millimetres, and so is the robot that is registered with it. That is no
error of the robot. Its own error is what is left when the instrument's frame (6 parameters a station) and the place of each measured
point on the tool (3 a point) are fitted, and no geometric parameter of the robot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.kinds import kind_of
from flexcal.calibration.measurement import (
    predict_measurements,
    predicted_positions,
    register,
    with_stations_at_base,
)
from flexcal.calibration.verification.best_fit_registration import (
    best_placement,
    can_register,
    can_register_with_points,
    rigid_placement,
)
from flexcal.data.poses import PoseSet
from flexcal.model.robot import RobotModel

_BLOCK = 20_000
_STEPS = 20
_RANK = 1e-6
_CAUCHY = 3.5
"""Constant of the Cauchy loss in median misfits: 2.4 standard deviations of normal errors."""
_SMALLEST = 1e-9
DECLARED_WITHIN = 0.05
"""Median distance between nominal and measured points, relative to the reach, above which the instrument's frame is not the declared
one.
"""


@dataclass(frozen=True, eq=False)
class UncalibratedRobot:
    """Uncalibrated robot as declared, best-fit registered, and with the measured points fitted too.

    `declared`: the instrument measures in the base frame, or stands, axes parallel to the base's, where robot.yaml says; None where the
    measured points are in another frame. `registered`: every station placed by the best rigid motion; None where its points are too few.
    `own`: stations and measured points placed; None with fewer than three coordinates a parameter.
    """

    declared: RobotModel | None
    registered: RobotModel | None
    own: RobotModel | None

    def errors(self, poses: PoseSet) -> UncalibratedErrors:
        """Errors at `poses`, whose stations and targets are among the placed ones."""
        statistics = (
            None if robot is None else poses.position - predicted_positions(robot, poses, elastic=False)
            for robot in (self.declared, self.registered, self.own)
        )
        return UncalibratedErrors(*statistics)


@dataclass(frozen=True, eq=False)
class UncalibratedErrors:
    """Error vectors (N, 3) m, measured minus predicted, of an uncalibrated robot placed as in `UncalibratedRobot`; None if not placed."""

    declared: np.ndarray | None
    registered: np.ndarray | None
    own: np.ndarray | None

    @property
    def known(self) -> Mapping[str, np.ndarray]:
        """Known errors by name."""
        every = {"declared": self.declared, "registered": self.registered, "own": self.own}
        return {name: errors for name, errors in every.items() if errors is not None}

    @property
    def robots_own(self) -> np.ndarray | None:
        """Errors of the robot itself for the headline; with too few poses those after registration, or None."""
        return self.registered if self.own is None else self.own

    def document(self) -> dict[str, Any]:
        """Block `before` of results.json; null if the errors are unknown."""
        every = (("declared", self.declared), ("registered", self.registered), ("own", self.own))
        return {
            name: None if errors is None else ErrorStatistics.of(errors).in_millimetres()
            for name, errors in every
        }


def uncalibrated_model(model: RobotModel, poses: PoseSet) -> UncalibratedRobot:
    """Place the instrument, and the measured points, of the nominal, rigid robot `model` by the measured points of `poses`.

    Kabsch (1976) for the registration; Gauss-Newton on the 6 parameters of every station and 3 of every measured point for the robot's own
    error. Raises `FlexcalError` for an unknown target or station.
    """
    model = model.with_stations(poses.places)
    for station in poses.stations:
        model.station_index(station)
    poses = poses.pointed.without_orientations()
    if not len(poses):
        return UncalibratedRobot(None, None, None)
    at_base = with_stations_at_base(model)
    if not (poses.located | poses.in_socket).all():
        return _placed_by_readings(at_base, poses)
    declared = _declared(at_base, poses)
    if not can_register(poses):
        return UncalibratedRobot(declared, None, None)
    position, orientation = _tools(at_base, poses)
    registered = at_base.with_values(rigid_placement(poses, position).values(at_base))
    own = None
    if can_register_with_points(poses):
        placement = best_placement(poses, position, orientation)
        own = at_base.with_values(placement.values(at_base))
    return UncalibratedRobot(declared, registered, own)


def _placed_by_readings(at_base: RobotModel, poses: PoseSet) -> UncalibratedRobot:
    """Robot whose stations, some of which read distances or touches, are placed by all readings, and then the measured points too."""
    located = predict_measurements(at_base, poses, elastic=False).located
    registered = register(at_base, poses, located)
    numbers = [
        f"station.{s}.{key}"
        for s in poses.stations
        for key in kind_of(poses, s).place(registered, poses.subset(poses.station == s), s, turned=True)
    ]
    points = [f"point.{target}.{axis}" for target in poses.targets for axis in "xyz"]
    return UncalibratedRobot(
        None, _refined(registered, poses, numbers), _refined(registered, poses, [*numbers, *points])
    )


def _refined(model: RobotModel, poses: PoseSet, names: Sequence[str]) -> RobotModel:
    """Robot with some parameters by Gauss-Newton, with the weights of the Cauchy loss; what is not determined stays."""
    for _ in range(_STEPS):
        at = predict_measurements(model, poses, elastic=False, jacobians=True)
        misfit = np.linalg.norm(at.residual, axis=1)
        scale = _CAUCHY * float(np.median(misfit)) + _SMALLEST
        root = 1 / np.sqrt(1 + (misfit / scale) ** 2)
        columns = (root[:, None, None] * at.jacobian(names)).reshape(-1, len(names))
        step = np.linalg.lstsq(columns, (root[:, None] * at.residual).ravel(), rcond=_RANK)[0]
        model = model.with_values(
            {name: model.value(name) + float(s) for name, s in zip(names, step, strict=True)}
        )
        if np.abs(step).max() < _SMALLEST:
            break
    return model


def _tools(model: RobotModel, poses: PoseSet) -> tuple[np.ndarray, np.ndarray]:
    """Positions (N, 3) and orientations (N, 3, 3) of the rigid robot's targets in its base frame."""
    blocks = [poses.subset(slice(first, first + _BLOCK)) for first in range(0, len(poses), _BLOCK)]
    predictions = (predict_measurements(model, block, elastic=False) for block in blocks)
    positions, orientations = zip(
        *((at.position, at.kinematics.orientation) for at in predictions), strict=True
    )
    return np.concatenate(positions), np.concatenate(orientations)


def _declared(model: RobotModel, poses: PoseSet) -> RobotModel | None:
    """Robot in the instrument's frame, if that is the base frame or at the declared stations; else None."""
    places = {
        name: np.array(station.in_base)
        for name, station in model.config.stations.items()
        if station.in_base is not None
    }
    beside = model.with_values(
        {
            f"station.{name}.{axis}": -float(value)
            for name, place in places.items()
            for axis, value in zip("xyz", place, strict=True)
        }
    )
    for candidate in (model, beside):
        away = poses.position - predicted_positions(candidate, poses, elastic=False)
        if np.median(np.linalg.norm(away, axis=1)) < DECLARED_WITHIN * model.reach:
            return candidate
    return None
