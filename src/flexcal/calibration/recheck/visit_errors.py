"""Errors of a calibrated robot at the poses of one visit, against the calibration or against an earlier visit to the same poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from flexcal.calibration.error_model import SAME_COMMAND, group_numbers
from flexcal.calibration.measurement import (
    PredictedMeasurements,
    predict_measurements,
    require_points,
    with_stations_at_base,
)
from flexcal.calibration.verification import (
    ErrorCovariance,
    prediction_errors_with_covariance,
    rigid_placement,
)
from flexcal.data.poses import PoseSet, last_digit
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import depends_on_temperature
from flexcal.model.robot import RobotModel
from flexcal.units import LEAST_STD

LEAST_MATCHED = 4
"""Least number of poses that two visits must have in common to be compared with each other."""
_LEAST_REPEATS = 12
"""Least degrees of freedom of repeated readings for which their scatter is used in place of the calibration's."""

Compared = Literal["calibration", "reference"]


@dataclass(frozen=True, eq=False)
class VisitErrors:
    """Errors at K poses and points of a visit, each the mean of its readings.

    Attributes
    ----------
    model : RobotModel
        The calibrated robot, with the instrument where it was placed for the visit.
    poses : PoseSet
        One row for every pose and point.
    errors : ndarray
        Measured minus predicted (3 K,), m; against a reference visit the change of that since.
    own : ndarray
        Covariance (3 K, 3 K), m², of what is independent from visit to visit: instrument and repeatability.
    common : ndarray
        Covariance (3 K, 3 K), m², of what visits compared with the same thing share: parameters and model error of the calibration,
        or noise of the reference visit.
    freedom : float
        Degrees of freedom of the size of these covariances, inf where it is known.
    compared : {"calibration", "reference"}
        With what the visit is compared.
    noise : {"calibration", "repeats"}
        Where the scatter is from: the calibration, or repeated readings of the same poses.
    placed : bool
        Whether the place of the instrument is unknown and fitted to the visit.
    """

    model: RobotModel
    poses: PoseSet
    errors: np.ndarray
    own: np.ndarray
    common: np.ndarray
    freedom: float
    compared: Compared
    noise: Literal["calibration", "repeats"]
    placed: bool

    @cached_property
    def at(self) -> PredictedMeasurements:
        """Predicted points, with what their derivatives need."""
        return predict_measurements(self.model, self.poses, jacobians=True)

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (3 K, 3 K), m², of the errors of a robot as calibrated."""
        return self.own + self.common

    def with_values(self, values: Mapping[str, float]) -> np.ndarray:
        """Errors (3 K,), m, left when parameters have these values."""
        moved = predict_measurements(self.model.with_values(values), self.poses).position - self.at.position
        return self.errors - moved.ravel()


def errors_from_calibration(model: RobotModel, poses: PoseSet, *, placed: bool) -> VisitErrors:
    """Errors of a visit against the calibrated model, with the covariance of the calibration's parameters, model error and scatter.

    With `placed` the instrument's place is fitted to the visit's points. Readings of the same pose count as one, for what the calibration
    knows of its model error is not averaged by repeating. Raises `FlexcalError` where neither the noise of the instrument nor scatter is
    known, and as predictions do.
    """
    poses = _points(poses)
    model = _placed(model, poses) if placed else model
    groups = _Readings.of(poses)
    first = poses.subset(groups.first)
    covariance = prediction_errors_with_covariance(model, first)[1]
    roots = covariance.roots.reshape(3 * len(first), -1)
    every = poses.position - predict_measurements(model, poses).position
    return VisitErrors(
        model,
        first,
        groups.mean(every).ravel(),
        _independent(covariance, model) + _rounding(poses) * np.eye(3 * len(first)),
        roots @ roots.T + _of_the_day(model, len(first)),
        covariance.freedom,
        "calibration",
        "calibration",
        placed,
    )


def errors_from_reference(
    model: RobotModel, poses: PoseSet, reference: PoseSet, *, placed: bool
) -> VisitErrors | None:
    """Change of the errors since a `reference` visit, at the poses and points that both have; None where these are fewer than four.

    Errors of model and parameters cancel, but for those of the expansion between different temperatures of the visits; what remains is the
    scatter of both visits: that of repeated readings within them where there are enough, else as the calibration found it, which may be
    larger, as errors of the model at single poses are part of it. With `placed` the instrument stands elsewhere than at the reference.
    Raises `FlexcalError` as `errors_from_calibration` does.
    """
    poses, reference = _points(poses), _points(reference)
    pairs = _matched(poses, reference)
    now, then = _Readings.of(poses), _Readings.of(reference)
    if len(pairs) < LEAST_MATCHED:
        return None
    base = _placed(model, reference) if _needs_place(model, reference) else model
    here = _placed(model, poses) if placed else base
    first = poses.subset(now.first[pairs[:, 0]])
    covariance = prediction_errors_with_covariance(here, first)[1]
    independent = _independent(covariance, here)
    errors = [
        group.mean(rows.position - predict_measurements(robot, rows).position)[pairs[:, k]]
        for k, (group, rows, robot) in enumerate(((now, poses, here), (then, reference, base)))
    ]
    freedom, noise, size = _scatter_freedom(covariance), "calibration", 1.0
    repeated = [
        group.scatter(rows.position, independent, pairs[:, k])
        for k, (group, rows) in enumerate(((now, poses), (then, reference)))
    ]
    squares, count = (sum(parts) for parts in zip(*repeated, strict=True))
    if count >= _LEAST_REPEATS:
        freedom, noise, size = float(count), "repeats", squares / count
    turned = frame_turns(here, base, first)
    weights = [np.repeat(1 / np.sqrt(group.count[pairs[:, k]]), 3) for k, group in enumerate((now, then))]
    own, common = (
        size * w[:, None] * independent * w + _rounding(rows) * np.eye(len(w))
        for w, rows in zip(weights, (poses, reference), strict=True)
    )
    warmed = _warmed(here, first, reference.subset(then.first[pairs[:, 1]]), covariance)
    common = common + warmed @ warmed.T
    return VisitErrors(
        here,
        first,
        (errors[0] - np.matmul(turned, errors[1][:, :, None])[:, :, 0]).ravel(),
        own,
        common,
        freedom,
        "reference",
        noise,
        placed,
    )


def planned_errors(
    model: RobotModel, poses: PoseSet, *, compared: Compared, placed: bool, rounds: int = 1, readings: int = 1
) -> VisitErrors:
    """Errors of a visit that is yet to be made, all zero, at `poses` whose points are not measured.

    The visit reads every pose `readings` times, and a reference visit `rounds` times as often. The size of the scatter is taken as known.
    """
    first = replace(_points(poses), position=predict_measurements(model, poses).position)
    covariance = prediction_errors_with_covariance(model, first)[1]
    independent = _independent(covariance, model)
    roots = covariance.roots.reshape(3 * len(first), -1)
    absolute = compared == "calibration"
    common = (
        roots @ roots.T + _of_the_day(model, len(first)) if absolute else independent / (rounds * readings)
    )
    freedom = covariance.freedom if absolute else _scatter_freedom(covariance)
    return VisitErrors(
        model,
        first,
        np.zeros(3 * len(first)),
        independent / readings,
        common,
        freedom,
        compared,
        "calibration",
        placed,
    )


@dataclass(frozen=True, eq=False)
class _Readings:
    """Groups of readings of the same pose and point: `label` (N,), the `first` row and the `count` (K,) of each."""

    label: np.ndarray
    first: np.ndarray
    count: np.ndarray

    @classmethod
    def of(cls, poses: PoseSet) -> _Readings:
        label = _labels(poses)
        first = np.array([int(np.flatnonzero(label == k)[0]) for k in range(int(label.max()) + 1)])
        return cls(label, first, np.bincount(label))

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Mean (K, 3) of values (N, 3) over the readings of each pose and point."""
        return np.stack([np.bincount(self.label, v) for v in values.T], axis=1) / self.count[:, None]

    def scatter(self, position: np.ndarray, independent: np.ndarray, chosen: np.ndarray) -> tuple[float, int]:
        """Sum of squares of the repeated readings of the `chosen` groups about their means, in units of the covariance that is expected
        for each point (3 M, 3 M), and its degrees of freedom.
        """
        apart = position - self.mean(position)[self.label]
        squares = 0.0
        for k, group in enumerate(chosen):
            root = np.linalg.cholesky(independent[3 * k : 3 * k + 3, 3 * k : 3 * k + 3])
            squares += float(np.sum(np.linalg.solve(root, apart[self.label == group].T) ** 2))
        return squares, 3 * int(np.sum(self.count[chosen] - 1))


def _labels(poses: PoseSet) -> np.ndarray:
    """Numbers (N,) of pose and point, equal where joint positions, target and payload are."""
    target = np.unique(poses.target, return_inverse=True)[1]
    payload = np.zeros(len(poses)) if poses.payload is None else poses.payload.round(6)
    return group_numbers(np.column_stack([np.round(poses.q / SAME_COMMAND), target, payload]))


def _matched(poses: PoseSet, reference: PoseSet) -> np.ndarray:
    """Groups (M, 2) of readings of both visits that are of the same pose and point."""
    now, then = _Readings.of(poses), _Readings.of(reference)
    pairs = []
    for k, row in enumerate(now.first):
        near = np.abs(reference.q[then.first] - poses.q[row]).max(axis=1) < SAME_COMMAND
        near &= reference.target[then.first] == poses.target[row]
        if poses.payload is not None and reference.payload is not None:
            near &= np.abs(reference.payload[then.first] - poses.payload[row]) < 1e-6
        if near.any():
            pairs.append((k, int(np.flatnonzero(near)[0])))
    return np.array(pairs, dtype=int).reshape(-1, 2)


def _points(poses: PoseSet) -> PoseSet:
    require_points(poses)
    if poses.in_socket.any():
        raise FlexcalError(
            "E-RECHECK-001", "a ball in sockets cannot recheck a robot; measure points with an instrument."
        )
    return poses.without_orientations()


def _needs_place(model: RobotModel, poses: PoseSet) -> bool:
    known = model.posterior.parameters.names
    return any(not any(n.startswith(f"station.{s}.") for n in known) for s in poses.stations)


def _placed(model: RobotModel, poses: PoseSet) -> RobotModel:
    """Robot with the instrument where its points fit best."""
    at_base = with_stations_at_base(model)
    placement = rigid_placement(poses, predict_measurements(at_base, poses).position)
    return model.with_values(placement.values(model))


def _warmed(model: RobotModel, poses: PoseSet, reference: PoseSet, covariance: ErrorCovariance) -> np.ndarray:
    """Roots (3 K, k), m, of the errors of the calibrated parameters that do not cancel as the visits had different temperatures."""
    if not depends_on_temperature(model):
        return np.zeros((3 * len(poses), 0))
    warm = [
        np.full(len(rows), float(model.thermal.reference[0]))
        if rows.temperature is None
        else rows.temperature
        for rows in (poses, reference)
    ]
    if np.allclose(*warm, rtol=0, atol=1e-9):
        return np.zeros((3 * len(poses), 0))
    before = prediction_errors_with_covariance(model, replace(poses, temperature=warm[1]))[1]
    return (covariance.roots - before.roots).reshape(3 * len(poses), -1)


def frame_turns(here: RobotModel, base: RobotModel, poses: PoseSet) -> np.ndarray:
    """Rotations (K, 3, 3) at poses from the instrument's frame as the robot `base` has it to that of `here`."""
    from flexcal.model.parts import vector_rotation

    turned = []
    for station in poses.station.tolist():
        rows = [
            vector_rotation(robot.stations.pose[robot.station_index(station), 3:]) for robot in (here, base)
        ]
        turned.append(rows[0] @ rows[1].T)
    return np.array(turned)


def _rounding(poses: PoseSet) -> float:
    """Variance, m², of coordinates by what their digits can carry, which repeating does not average."""
    return max(last_digit(poses.position) / np.sqrt(12), LEAST_STD) ** 2


def _independent(covariance: ErrorCovariance, model: RobotModel) -> np.ndarray:
    """Covariance (3 K, 3 K) m² of instrument and repeatability, with what the points of one pose share."""
    # a scatter without a degree of freedom is that of points that were simulated without noise
    if covariance.independent is None or covariance.freedom < 1:
        raise FlexcalError(
            "E-RECHECK-002",
            f"neither the noise of the instrument nor the scatter of {model.name} is known, so nothing can be tested; give the "
            "column sigma, or calibrate with more poses.",
        )
    count = len(covariance.independent)
    whole = np.zeros((count, 3, count, 3))
    if covariance.visit is not None and covariance.common is not None:
        shared = np.einsum("iak,jbk->iajb", covariance.common, covariance.common, optimize=True)
        same = covariance.visit[:, None] == covariance.visit[None]
        whole = shared * same[:, None, :, None]
    for k in range(count):
        whole[k, :, k] = covariance.independent[k]
    return whole.reshape(3 * count, 3 * count)


def _of_the_day(model: RobotModel, count: int) -> np.ndarray:
    """Covariance (3 K, 3 K), m², of a displacement of all points of a visit, of the size of the calibration's model error.

    Part of that is common to a stretch of the measuring order, as of a robot that warms up, and a visit is such a stretch.
    """
    moved = model.value("scatter.model") * np.tile(np.eye(3), (count, 1))
    return moved @ moved.T


def _scatter_freedom(covariance: ErrorCovariance) -> float:
    """Degrees of freedom of the scatter alone, from those of the whole prediction."""
    assert covariance.independent is not None
    scatter = float(np.trace(covariance.independent, axis1=1, axis2=2).sum())
    whole = scatter + float((covariance.roots**2).sum())
    return covariance.freedom * (scatter / whole) ** 2 if whole > 0 else covariance.freedom
