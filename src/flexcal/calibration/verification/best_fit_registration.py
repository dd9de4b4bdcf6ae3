"""Best-fit registration of the instrument, and of the measured points on the tool, to given positions of a robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.error_model import group_numbers
from flexcal.calibration.kinds import best_motion, rigid_motion
from flexcal.data.poses import PoseSet
from flexcal.model.parts import rotation_vector, vector_rotation
from flexcal.model.robot import STATION, RobotModel

_LEAST_POINTS = 4
_STEPS = 20
_SMALL = 1e-10
"""Gauss-Newton step, m and rad, at which the iteration has converged."""
_RANK = 1e-8
_BLOCK = 20_000
"""Number of points linearised together."""


@dataclass(frozen=True, eq=False)
class Placement:
    """Rotation (3, 3) and position (3,) m of the robot's base in each station's frame, and shift (3,) m of each target in the axes of
    its own frame.
    """

    stations: Mapping[str, tuple[np.ndarray, np.ndarray]]
    shifts: Mapping[str, np.ndarray]

    def values(self, model: RobotModel) -> dict[str, float]:
        """Parameters of stations and points that place `model` there."""
        parameters: dict[str, float] = {}
        for name, (turn, offset) in self.stations.items():
            numbers = (*offset, *rotation_vector(turn))
            parameters |= {f"station.{name}.{key}": float(v) for key, v in zip(STATION, numbers, strict=True)}
        for name, shift in self.shifts.items():
            for axis, value in zip("xyz", shift, strict=True):
                parameters[f"point.{name}.{axis}"] = model.value(f"point.{name}.{axis}") + float(value)
        return parameters

    def expected(self, poses: PoseSet, nominal: np.ndarray, orientation: np.ndarray) -> np.ndarray:
        """Expected instrument readings of the targets (N, 3) m, which are at `nominal` (N, 3), rotated by `orientation` (N, 3, 3)."""
        expected = np.empty(nominal.shape)
        shift = np.zeros(nominal.shape)
        for target, moved in self.shifts.items():
            shift[poses.target == target] = moved
        at = nominal + np.matmul(orientation, shift[:, :, None])[:, :, 0]
        for name, (turn, offset) in self.stations.items():
            own = poses.station == name
            expected[own] = at[own] @ turn.T + offset
        return expected


def rigid_placement(poses: PoseSet, nominal: np.ndarray) -> Placement:
    """Placement of every station by the rigid motion that best maps `nominal` (N, 3) m, base frame, to the measured points (Kabsch
    1976).
    """
    stations = {}
    for name in poses.stations:
        own = poses.station == name
        motion = best_motion if name in poses.fixtures else rigid_motion
        stations[name] = motion(nominal[own], poses.position[own], name)
    return Placement(stations, {})


def best_placement(poses: PoseSet, nominal: np.ndarray, orientation: np.ndarray) -> Placement:
    """Least-squares placement of stations and points: measured = R (nominal + orientation · shift) + t, by Gauss-Newton from Kabsch's R,
    t.

    `nominal` (N, 3) m and `orientation` (N, 3, 3) of each target's frame, in the base frame. What the poses cannot tell apart (a tool that
    never turns: where the point is, and where the instrument) is the shortest step from where it was.
    """
    placement = rigid_placement(poses, nominal)
    shifts = {name: np.zeros(3) for name in poses.targets}
    points_from = 6 * len(placement.stations)
    blocks = [slice(first, first + _BLOCK) for first in range(0, len(poses), _BLOCK)]
    parts = [(poses.subset(rows), nominal[rows], orientation[rows]) for rows in blocks]
    placement = Placement(placement.stations, shifts)
    for _ in range(_STEPS):
        factor = np.zeros((0, points_from + 3 * len(shifts) + 1))
        for part in parts:
            factor = np.asarray(np.linalg.qr(np.vstack([factor, _linearised(placement, *part)]), mode="r"))
        step = np.linalg.lstsq(factor[:, :-1], factor[:, -1], rcond=_RANK)[0]
        stations = {}
        for k, (name, (turn, offset)) in enumerate(placement.stations.items()):
            own = step[6 * k : 6 * k + 6]
            stations[name] = (vector_rotation(own[:3]) @ turn, offset + own[3:])
        moved = step[points_from:].reshape(-1, 3)
        shifts = {
            name: shift + own for (name, shift), own in zip(placement.shifts.items(), moved, strict=True)
        }
        placement = Placement(stations, shifts)
        if np.abs(step).max() < _SMALL:
            break
    return placement


def _linearised(
    placement: Placement, poses: PoseSet, nominal: np.ndarray, orientation: np.ndarray
) -> np.ndarray:
    """Jacobian (3 N, k + 1) of the points by each station's rotation and offset and every target's shift; last column the residual, m."""
    points_from = 6 * len(placement.stations)
    expected = placement.expected(poses, nominal, orientation)
    columns = np.zeros((len(poses), 3, points_from + 3 * len(placement.shifts) + 1))
    for k, (name, (turn, offset)) in enumerate(placement.stations.items()):
        own = poses.station == name
        columns[own, :, 6 * k : 6 * k + 3] = -np.cross(
            (expected[own] - offset)[:, :, None], np.eye(3), axis=1
        )
        columns[own, :, 6 * k + 3 : 6 * k + 6] = np.eye(3)
        for j, target in enumerate(placement.shifts):
            seen = own & (poses.target == target)
            columns[seen, :, points_from + 3 * j : points_from + 3 * j + 3] = turn @ orientation[seen]
    columns[:, :, -1] = poses.position - expected
    return columns.reshape(-1, columns.shape[2])


def can_register_with_points(poses: PoseSet) -> bool:
    """Whether there are three coordinates per parameter of `best_placement`, without repeated visits."""
    return _distinct(poses) >= 6 * len(poses.stations) + 3 * len(poses.targets)


def can_register(poses: PoseSet) -> bool:
    """Whether every station has four points that are not collinear, without repeated visits, so that residuals remain after
    registration.
    """
    for station in poses.stations:
        own = poses.subset(poses.station == station)
        centred = own.position - own.position.mean(axis=0)
        flat = station not in poses.fixtures and np.linalg.matrix_rank(centred, tol=1e-3) < 2
        if _distinct(own) < _LEAST_POINTS or flat:
            return False
    return True


def _distinct(poses: PoseSet) -> int:
    """Number of joint positions with a target, without repeated visits."""
    labels = [np.unique(names, return_inverse=True)[1] for names in (poses.target, poses.station)]
    return int(group_numbers(np.column_stack([poses.q.round(3), *labels])).max(initial=-1)) + 1
