"""Ratio of logged torques to the gravity torques of the links; close to zero for torques on the motor side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.recordings import Recording
from flexcal.model.robot import RobotModel
from flexcal.model.statics import gravity_torque

_POSES = 200
"""Number of samples of a block at which gravity torques are evaluated."""
_TOO_WEAK = 1 / 20
"""Ratio of torques to gravity torques below which they are motor-side: gear ratios begin beyond, currents in A do not reach it."""
_HEAVY = 1 / 10
"""Least gravity torque of a joint, relative to the largest, for a check of its sign."""
_AGAINST = -1 / 2
"""Correlation with gravity torques below which the sign is reversed; friction brings it near zero, but not below."""
_LIVELY = 2.0
"""Ratio of torques to gravity torques above which accelerations dominate and say nothing about the sign."""
_SMALL = 1 / 8
"""Torque relative to gravity torque that friction may add to motor-side torques."""


@dataclass(frozen=True, eq=False)
class GravityTorqueCheck:
    """Sums over samples, per joint (n,): `weight_squares` and `torque_squares`, (N m)², and `cross_products` of both.

    The weight is that of the links, and of what a log says that they hold; zero at joints with a declared spring, which may balance it.
    """

    weight_squares: np.ndarray
    torque_squares: np.ndarray
    cross_products: np.ndarray

    @classmethod
    def empty(cls, joints: int) -> GravityTorqueCheck:
        """Check without samples."""
        return cls(*np.zeros((3, joints)))

    @classmethod
    def of(cls, recording: Recording, model: RobotModel) -> GravityTorqueCheck:
        """Check of evenly spread samples."""
        some = slice(None, None, max(1, len(recording) // _POSES))
        payload = None if recording.payload is None else recording.payload[some]
        weight, torque = gravity_torque(model, recording.q[some], payload), recording.torque[some]
        if recording.external_torque is not None:
            torque = torque + recording.external_torque[some]
        balanced = [entry.joint for entry in model.config.dynamics.joint_springs]
        weight[:, [name in balanced for name in model.joint_names]] = 0.0
        return cls(*(np.sum(x, axis=0) for x in (weight**2, torque**2, weight * torque)))

    def __add__(self, other: GravityTorqueCheck) -> GravityTorqueCheck:
        return GravityTorqueCheck(
            self.weight_squares + other.weight_squares,
            self.torque_squares + other.torque_squares,
            self.cross_products + other.cross_products,
        )

    @property
    def heaviest(self) -> int:
        """Joint with the largest gravity torque."""
        return int(np.argmax(self.weight_squares))

    @property
    def share(self) -> float:
        """Ratio of the torques of that joint to its gravity torque; 1 without gravity torques."""
        k = self.heaviest
        return (
            float(abs(self.cross_products[k]) / self.weight_squares[k]) if self.weight_squares[k] > 0 else 1.0
        )

    @property
    def reversed(self) -> int | None:
        """First joint of sufficient gravity torque whose torques have the opposite sign; None if there is none."""
        heavy = self.weight_squares > _HEAVY**2 * self.weight_squares.max()
        told = self.torque_squares < _LIVELY**2 * self.weight_squares
        against = self.cross_products < _AGAINST * np.sqrt(self.weight_squares * self.torque_squares)
        return next((int(k) for k in np.flatnonzero(heavy & told & against)), None)

    @property
    def on_motor_side(self) -> bool:
        """Whether the torques are too weak for joint torques, and too small for friction to be the reason."""
        k = self.heaviest
        return self.share < _TOO_WEAK and bool(self.torque_squares[k] < _SMALL**2 * self.weight_squares[k])
