"""Motor axes: those of the joints, except for coupled motors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from flexcal.model.robot import RobotModel


@dataclass(frozen=True)
class MotorAxis:
    """Motor axis of the joint `name`, number `joint`.

    It turns by the sum of ratio · q_j over (j, ratio) in `shares`, and joint j feels ratio times its torque.
    """

    name: str
    joint: int
    shares: tuple[tuple[int, float], ...]

    def of(self, values: np.ndarray) -> np.ndarray:
        """Positions, velocities or accelerations (N,) of this axis from those of the joints (N, n)."""
        return sum((ratio * values[:, joint] for joint, ratio in self.shares), np.zeros(len(values)))


@lru_cache(maxsize=4)
def motor_axes(model: RobotModel) -> tuple[MotorAxis, ...]:
    """Motor axes, one per joint, with the couplings in `drives: coupling:`."""
    axes = []
    for number, name in enumerate(model.joint_names):
        entries = [entry for entry in model.config.drives.coupling if entry.motor == name]
        shares = ((number, 1.0), *((model.joint_index(entry.joint), entry.ratio) for entry in entries))
        axes.append(MotorAxis(name, number, shares))
    return tuple(axes)


def motor_shares(model: RobotModel) -> np.ndarray:
    """Coupling matrix S (n, n): motor positions are S q, and joint torques Sᵀ τ for motor torques τ."""
    shares = np.zeros((model.n, model.n))
    for axis in motor_axes(model):
        for joint, ratio in axis.shares:
            shares[axis.joint, joint] = ratio
    return shares
