"""Rotations that the motors of a robot give its tool."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics.forward import motor_motion, point_kinematics
from flexcal.model.kinematics.joint_space import low_discrepancy_configurations
from flexcal.model.robot import RobotModel

_POSTURES = 64
_TURNS = 0.05
"""Root mean square rotation, rad per rad or m of the motors, below which axes that are not quite parallel explain it."""


def rotation_freedom(model: RobotModel, point: str) -> int:
    """Number of directions in the base frame about which the motors turn a point's frame: 3 for most arms, 1 for a SCARA, 0 for a Delta."""
    q = low_discrepancy_configurations(model, _POSTURES)
    motion = point_kinematics(model, q, point=point).motion_jacobian[:, 3:, :, 2] @ motor_motion(model)
    sizes = np.linalg.svd(np.concatenate(list(motion), axis=1), compute_uv=False) / np.sqrt(len(q))
    return int(np.sum(sizes > _TURNS))
