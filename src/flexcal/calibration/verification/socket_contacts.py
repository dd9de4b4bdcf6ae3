"""Verification by a ball in sockets: whether all contacts with a socket are predicted at one place, and the sockets at their distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexcal.calibration.error_model import group_numbers
from flexcal.calibration.kinds import Sockets, about_sockets, declared_distances, socket_numbers
from flexcal.calibration.measurement import predict_measurements, with_stations_at_base
from flexcal.calibration.verification.uncalibrated_robot import UncalibratedErrors
from flexcal.calibration.verification.unseen_poses import (
    ErrorCovariance,
    PredictionErrors,
    prediction_errors_with_covariance,
)
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel, socket_scale
from flexcal.units import MILLIMETRE

_RANK = 1e-6


@dataclass(frozen=True)
class SocketDistance:
    """Distance of two `sockets` at one `place` of their fixture, m: `declared`, and the `error` of that predicted by the robot.

    `before` is the error of the uncalibrated robot, None where its ball was not found, and `std` the predicted standard deviation of the
    error; None where the scatter of contacts is not known.
    """

    place: str
    sockets: tuple[str, str]
    declared: float
    error: float
    before: float | None
    std: float | None

    def document(self) -> dict[str, Any]:
        """Entry of `distances` in results.json."""
        return {
            "place": self.place,
            "sockets": list(self.sockets),
            "declared_mm": self.declared / MILLIMETRE,
            "error_mm": self.error / MILLIMETRE,
            "before_mm": None if self.before is None else self.before / MILLIMETRE,
            "std_mm": None if self.std is None else self.std / MILLIMETRE,
        }


@dataclass(frozen=True, eq=False)
class SocketVerification:
    """Errors of a calibrated robot at contacts of a ball with sockets.

    `model` has the fixtures in the base frame, where all errors are. `result` are the deviations of the ball, as predicted, from its mean
    in each socket, with their predicted size, and `covariance` is that of these; `before` the same deviations of the uncalibrated robot,
    with the ball as declared and found; `distances` those of the sockets.
    """

    model: RobotModel
    result: PredictionErrors
    covariance: ErrorCovariance
    before: UncalibratedErrors
    distances: tuple[SocketDistance, ...]


def require_contacts(poses: PoseSet) -> None:
    """Raise `FlexcalError` for a ball that was once in one of its sockets, and for measurements of another kind beside contacts."""
    if not poses.in_socket.all():
        raise FlexcalError(
            "E-CAL-039",
            "contacts with sockets and points of an instrument are verified apart; give their files to two runs of 'flexcal verify'.",
        )
    assert poses.socket is not None
    once = np.flatnonzero(~repeated_contacts(poses))
    if once.size:
        names = ", ".join(f"{poses.station[k]} {poses.socket[k]}" for k in once[:4].tolist())
        more = f" and {len(once) - 4} more" if len(once) > 4 else ""
        raise FlexcalError(
            "E-CAL-040",
            f"one contact with a socket ({names}{more}) finds where the socket is and verifies nothing; measure each socket in 2 postures "
            "or more, or leave it out.",
        )


def repeated_contacts(poses: PoseSet) -> np.ndarray:
    """Rows (N,) of sockets with two contacts or more, of a set of contacts."""
    number = socket_numbers(poses)
    return np.bincount(number)[number] > 1


def verify_contacts(
    model: RobotModel, nominal: RobotModel, poses: PoseSet, *, known: bool
) -> SocketVerification:
    """Errors of a calibrated robot at contacts outside the fit, beside those of the `nominal` one.

    Where a socket is follows from its own contacts: it is the mean of the predicted positions of the ball in it, as in `held_out_errors`.
    `known` says whether the scatter of contacts is that of the calibration, which it is where that was of sockets alone.
    """
    number = socket_numbers(poses)
    robot = with_stations_at_base(model.with_stations(poses.places))
    result, covariance = prediction_errors_with_covariance(robot, poses)
    if not known:
        covariance = replace(covariance, independent=None)
    deviations = _about_sockets(covariance, number)
    before = _with_ball_found(with_stations_at_base(nominal.with_stations(poses.places)), poses, number)
    errors = about_sockets(result.errors, number)
    squares = np.sum(deviations.roots**2, axis=1)
    parameters, scatter = (
        part.sum(axis=1) for part in np.split(squares, [squares.shape[1] - covariance.shared], axis=1)
    )
    if deviations.independent is not None:
        scatter = scatter + np.trace(deviations.independent, axis1=1, axis2=2)
    return SocketVerification(
        robot,
        PredictionErrors(
            poses.position - errors, errors, np.sqrt(parameters), np.sqrt(scatter), result.ambiguous
        ),
        deviations,
        UncalibratedErrors(
            None, *(None if ball is None else -about_sockets(ball, number) for ball in before)
        ),
        _distances(robot, poses, number, (result.position, before[1]), covariance),
    )


def _about_sockets(covariance: ErrorCovariance, number: np.ndarray) -> ErrorCovariance:
    """Covariance of the deviations from the means of the contacts of equal `number` (N,)."""
    count = np.bincount(number)[number]
    own = covariance.independent
    if own is not None:
        weights = (1 / count)[:, None, None]
        own = (1 - 2 * weights) * own + weights * (own - about_sockets(own, number))
    return replace(
        covariance,
        roots=about_sockets(covariance.roots, number),
        independent=own,
        visit=None,
        common=None,
        concentrated=count / (count - 1),
    )


def _with_ball_found(
    model: RobotModel, poses: PoseSet, number: np.ndarray
) -> tuple[np.ndarray, np.ndarray | None]:
    """Positions (N, 3) m of the ball by the rigid robot `model`, as declared, and with the ball on the tool where contacts agree best.

    None for these with fewer than three coordinates a parameter. What the contacts do not tell of the ball stays as declared.
    """
    at = predict_measurements(model, poses, elastic=False)
    ball, orientation = at.kinematics.position, at.kinematics.orientation
    if len(np.unique(group_numbers(poses.q.round(3), number))) < len(np.unique(number)) + 3 * len(
        poses.targets
    ):
        return ball, None
    moved = [np.where((poses.target == name)[:, None, None], orientation, 0.0) for name in poses.targets]
    columns = np.concatenate(moved, axis=2)
    table = about_sockets(columns, number).reshape(3 * len(poses), -1)
    shift = np.linalg.lstsq(table, -about_sockets(ball, number).ravel(), rcond=_RANK)[0]
    return ball, ball + columns @ shift


def _distances(
    model: RobotModel,
    poses: PoseSet,
    number: np.ndarray,
    balls: Sequence[np.ndarray | None],
    covariance: ErrorCovariance,
) -> tuple[SocketDistance, ...]:
    """Distances of the sockets by the positions of the ball (N, 3), m, calibrated and before, of which the first has the `covariance`."""
    found = []
    for item in declared_distances(poses):
        between = [None if ball is None else item.between(ball, number) for ball in balls]
        errors = [None if own is None else float(np.linalg.norm(own)) - item.distance for own in between]
        assert between[0] is not None and errors[0] is not None
        along, std = between[0] / np.linalg.norm(between[0]), None
        if covariance.independent is not None:
            root = along @ item.between(covariance.roots, number)
            noise = [
                along @ covariance.independent[own].mean(axis=0) @ along / own.sum()
                for own in (number == one for one in item.numbers)
            ]
            scale = socket_scale(item.holder)
            # what the calibration found of the fixture's scale is among the roots
            declared = 0.0 if model.posterior.determines(scale) else Sockets().scale_std(model, scale) or 0.0
            std = float(np.sqrt(root @ root + sum(noise) + (declared * item.distance) ** 2))
        found.append(SocketDistance(item.place, item.sockets, item.distance, errors[0], errors[1], std))
    return tuple(found)
