"""Errors of a calibration at groups of measurements that are left out whole, one group after the other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.kinds import about_sockets, declared_distances, socket_numbers
from flexcal.calibration.measurement import predict_measurements, register
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False)
class HeldOutGroup:
    """Errors at one group that was left out: `errors`, and the mean error of known distances between sockets, m; None without sockets."""

    errors: ErrorStatistics
    distance: float | None


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Errors at the `groups` by name, each left out of its own calibration; `by` names what groups the measurements.

    `left_out` wrong readings of distances and contacts are in no group.
    """

    by: str
    groups: Mapping[str, HeldOutGroup]
    left_out: int = 0

    @property
    def mean(self) -> float:
        """Mean over the groups of their mean errors, m."""
        return float(np.mean([group.errors.mean for group in self.groups.values()]))

    @property
    def distance(self) -> float | None:
        """Mean over the groups of the error of known distances, m."""
        known = [group.distance for group in self.groups.values() if group.distance is not None]
        return float(np.mean(known)) if known else None

    def document(self) -> dict[str, Any]:
        """Block `held_out` of results.json."""
        return {
            "by": self.by,
            "groups": {
                name: group.errors.in_millimetres() | {"distance_mm": _millimetres(group.distance)}
                for name, group in self.groups.items()
            },
            "outliers": self.left_out,
            "mean_mm": self.mean / MILLIMETRE,
            "distance_mm": _millimetres(self.distance),
        }


def held_out_errors(
    calibrated: Callable[[PoseSet], RobotModel],
    poses: PoseSet,
    by: str,
    labels: np.ndarray,
    *,
    left_out: int = 0,
) -> HeldOut:
    """Leave out every group of equal `labels` (N,) in turn, and compare it with the robot `calibrated` on the rest.

    A fixture or an instrument whose rows are all in the group is placed by these: each socket is the mean of the predicted positions of the
    ball in it; the ball and the robot stay as calibrated on the rest. `left_out` is how many wrong readings are not among them. Raises
    `FlexcalError` for fewer than two groups. Inclinometers, which tell no place, are calibrated with and not compared.
    """
    names = list(dict.fromkeys(labels[~poses.tilted].tolist()))
    if len(names) < 2:
        raise FlexcalError(
            "E-RUN-101", f"'{by}' is the same in all measurements of places; nothing can be held out by it."
        )
    groups = {}
    for name in names:
        own = labels == name
        groups[str(name)] = held_out_group(
            calibrated(poses.subset(~own)), poses.subset(own).pointed, set(poses.station[~own])
        )
    return HeldOut(by, groups, left_out)


def held_out_group(model: RobotModel, poses: PoseSet, known: set[str]) -> HeldOutGroup:
    """Errors of a calibrated robot at poses that were left out; stations that are not `known` to it are placed by these."""
    model = model.with_stations(poses.places)
    at = predict_measurements(model, poses)
    errors = poses.position - at.position
    measured = ~poses.in_socket
    for station in dict.fromkeys(poses.station[measured].tolist()):
        if station not in known:
            own = poses.subset(measured & (poses.station == station))
            bare = model.with_values(
                {f"station.{station}.{key}": 0.0 for key in ("x", "y", "z", "rx", "ry", "rz")}
            )
            placed = register(bare, own, predict_measurements(bare, own).located)
            errors[measured & (poses.station == station)] = (
                own.position - predict_measurements(placed, own).position
            )
    ball, number = at.kinematics.position, socket_numbers(poses)
    errors[~measured] = about_sockets(ball, number)[~measured]
    off = [
        abs(np.linalg.norm(item.between(ball, number)) - item.distance) for item in declared_distances(poses)
    ]
    return HeldOutGroup(ErrorStatistics.of(errors), float(np.mean(off)) if off else None)


def _millimetres(value: float | None) -> float | None:
    return None if value is None else value / MILLIMETRE
