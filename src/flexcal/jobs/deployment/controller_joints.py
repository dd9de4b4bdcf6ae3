"""Joint positions as a controller counts them, and as the URDF does."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.jobs.deployment.controller_base import controller_base
from flexcal.model.kinematics import link_frames
from flexcal.model.robot import RobotModel
from flexcal.programs import Dialect
from flexcal.units import DEGREE

_STANDS = np.cos(10 * DEGREE)
"""Cosine of the angle within which a direction stands as it should: a nominal arm has right angles."""


@dataclass(frozen=True, eq=False)
class ControllerJoints:
    """q_URDF = signs · q_controller + zeros of the six joints of the `nominal` robot; `signs` (6,) are ±1, `zeros` (6,) in rad or m.

    Where the dialect counts joint 3 from the horizontal, q_controller is that of joint 2 added to joint 3.
    """

    nominal: RobotModel
    dialect: Dialect
    signs: np.ndarray
    zeros: np.ndarray

    @cached_property
    def unit(self) -> np.ndarray:
        """Units (6,) of the program's numbers, rad or m."""
        notation = self.dialect.notation
        kinds = [joint.kind for joint in self.nominal.motor_joints]
        return np.array([notation.length if kind == "prismatic" else notation.angle for kind in kinds])

    @cached_property
    def _matrix(self) -> np.ndarray:
        matrix = np.eye(6)
        matrix[2, 1] = float(self.dialect.level_forearm)
        return self.signs[:, None] * matrix

    def to_urdf(self, numbers: np.ndarray) -> np.ndarray:
        """Joint positions (..., 6) of the URDF, rad or m, of the program's numbers (..., 6)."""
        return (np.asarray(numbers) * self.unit) @ self._matrix.T + self.zeros

    def from_urdf(self, q: np.ndarray) -> np.ndarray:
        """Numbers (..., 6) of the program of joint positions (..., 6) of the URDF."""
        return self.controller_radians(q) / self.unit

    def controller_radians(self, q: np.ndarray) -> np.ndarray:
        """Joint positions (..., 6) of the controller, rad or m, of those of the URDF."""
        return (q - self.zeros) @ np.linalg.inv(self._matrix).T

    def base_error(self) -> float:
        """Height (m) of axis 2 above the origin of the controller's base frame, where that should lie at its height; else 0."""
        if self.dialect.zero is None or not self.dialect.zero.base_at_axis_2:
            return 0.0
        base = controller_base(self.nominal)
        _, origin = link_frames(self.nominal, self.to_urdf(np.zeros(6))[None])
        axis_2 = self.nominal.joints.index(self.nominal.motor_joints[1])
        return float((base.rotation.T @ (origin[0, axis_2] - base.position))[2])

    def differing(self) -> str:
        """What of the arm does not stand at the controller's zero as that of the maker does; empty where all does, or nothing is known."""
        zero = self.dialect.zero
        if zero is None:
            return ""
        base = controller_base(self.nominal)
        rotation, origin = link_frames(self.nominal, self.to_urdf(np.zeros(6))[None])
        motors = [self.nominal.joints.index(joint) for joint in self.nominal.motor_joints]
        axes = np.array([rotation[0, i] @ self.nominal.joints[i].axis for i in motors]) * self.signs[:, None]
        for number, (axis, expected) in enumerate(
            zip(axes @ base.rotation, np.array(zero.axes), strict=True), 1
        ):
            if axis @ expected < _STANDS:
                return f"joint {number} turns about {_direction(axis)} where the controller's turns about {_direction(expected)}"
        arm = base.rotation.T @ (origin[0, motors[2]] - origin[0, motors[1]])
        arm = arm - (arm @ np.array(zero.axes[1])) * np.array(zero.axes[1])
        if arm @ np.array(zero.lower_arm) < _STANDS * np.linalg.norm(arm):
            points = _direction(arm / np.linalg.norm(arm))
            return f"the lower arm points along {points}, the controller's along {_direction(zero.lower_arm)}"
        return ""


def _direction(vector: np.ndarray | tuple[float, float, float]) -> str:
    """Name of an axis of coordinates, or three numbers."""
    values = np.asarray(vector, dtype=float)
    largest = int(np.argmax(np.abs(values)))
    if abs(values[largest]) > _STANDS:
        return f"{'+' if values[largest] > 0 else '-'}{'xyz'[largest]}"
    return "(" + ", ".join(f"{value:.2f}" for value in values) + ")"
