"""Residuals along the motion of every joint, and the gravity torque on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.fit import GeometricFit
from flexcal.model.parts import vector_rotation
from flexcal.model.statics import carried_mass, gravity_torque, points_kinematics

_MOST = 1500


@dataclass(frozen=True, eq=False)
class GravityLoads:
    """Loads and residuals at N points of a robot with n motors.

    `torque` (N, n) is the gravity torque on the drives, N m; `along` (N, n), m, by model the residual along the motion of the point by
    each motor.
    """

    torque: np.ndarray
    along: Mapping[str, np.ndarray]


def gravity_loads(fit: GeometricFit, residuals: Mapping[str, np.ndarray]) -> GravityLoads:
    """Loads of a calibrated robot, for `residuals` (N, 3) m in the instrument's frame by model.

    Of more than 1500 points some, evenly chosen.
    """
    measured = fit.poses.pointed
    rows = np.unique(np.linspace(0, len(measured) - 1, min(len(measured), _MOST)).astype(int))
    model, poses = fit.model, measured.subset(rows)
    motors = list(model.motors)
    at = points_kinematics(model, poses.q, None, poses.target, jacobians=True)
    motion = at.motion_jacobian[:, :3, motors, 2]
    size = np.linalg.norm(motion, axis=1, keepdims=True)
    direction = np.divide(motion, size, out=np.zeros_like(motion), where=size > 1e-9)
    turns = {
        name: vector_rotation(model.stations.pose[model.station_index(name)][3:]) for name in poses.stations
    }
    turn = np.array([turns[name] for name in poses.station])
    seen = np.matmul(turn, direction)
    masses = carried_mass(model, poses.payload, len(poses))
    along = {name: np.matmul(errors[rows, None, :], seen)[:, 0] for name, errors in residuals.items()}
    return GravityLoads(gravity_torque(model, poses.q, masses)[:, motors], along)
