"""Limits of a motion: joints, drives and target point, with the used fraction of each between -1 and 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.design.trajectories.regressor_columns import BaseRegressor
from flexcal.model.kinematics import joint_ranges
from flexcal.model.robot import RobotModel


@dataclass(frozen=True, eq=False)
class MotionLimits:
    """Ranges of the joints `lower`, `upper` (n,), rad or m, and largest `velocity`, `acceleration` and motor `torque` (n,), inf for none.

    The target point stays in `box` (2, 3), m in the base frame, and is no faster than `speed`, m/s; inf for none.
    """

    lower: np.ndarray
    upper: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray
    box: np.ndarray
    speed: float

    @classmethod
    def of(cls, model: RobotModel, share: float = 1.0) -> MotionLimits:
        """Limits of the URDF and of robot.yaml's `limits:`; `share` is the usable part of velocity, acceleration and torque.

        Raises `FlexcalError` for limits that cross and `InputError` for lists that do not fit the robot.
        """
        lower, upper = joint_ranges(model)
        own = model.config.limits
        speed = np.inf if own.speed is None else own.speed
        box = [[-np.inf] * 3, [np.inf] * 3] if own.box is None else [own.box.lower, own.box.upper]
        acceleration = np.full(model.n, np.inf) if own.acceleration is None else np.array(own.acceleration)
        velocity = np.array([joint.velocity for joint in model.joints])
        torque = np.array([joint.effort for joint in model.joints])
        return cls(
            lower,
            upper,
            share * np.where(velocity > 0, velocity, np.inf),
            share * acceleration,
            share * np.where(torque > 0, torque, np.inf),
            np.array(box, dtype=float),
            speed,
        )

    @property
    def cartesian(self) -> bool:
        """Whether the target point is limited."""
        return bool(np.isfinite(self.speed) or np.isfinite(self.box).any())

    def shares(self, motion: np.ndarray, columns: BaseRegressor) -> dict[str, np.ndarray]:
        """Fractions (N, n) of the limits used by q, q̇, q̈ (3, N, n), and by the motor torques, with friction, of the robot of `columns`.

        Accelerations are left out where none is limited.
        """
        q, dq, ddq = motion
        half, middle = (self.upper - self.lower) / 2, (self.upper + self.lower) / 2
        torque = np.einsum("jrn,r->nj", columns.write(motion), columns.base_values)
        taken = {"position": (q - middle) / half, "velocity": dq / self.velocity}
        if np.isfinite(self.acceleration).any():
            taken["acceleration"] = ddq / self.acceleration
        return taken | {"torque": torque / self.torque}
