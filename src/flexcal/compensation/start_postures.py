"""Start postures of inverse kinematics for points without joint positions."""

from __future__ import annotations

import numpy as np

from flexcal.compensation.inverse_kinematics import inverse_kinematics
from flexcal.compensation.tool_target import ToolPoseTarget
from flexcal.model.kinematics import (
    joint_ranges,
    low_discrepancy_configurations,
    motor_motion,
    point_kinematics,
)
from flexcal.model.robot import RobotModel

_POSTURES = 256
_OTHER_STARTS = 32


def best_posture(model: RobotModel, target: str | None = None) -> np.ndarray:
    """Posture (n,) farthest from singularities and limits out of 256 spread over the joint ranges.

    That is: the smallest singular value of its Jacobian, rotations being weighted by the reach, times the share of its range that the
    nearest limit leaves a joint, is the largest. An arm that cannot turn its tool every way is judged by positions alone.
    """
    postures = low_discrepancy_configurations(model, _POSTURES)
    jacobian = point_kinematics(model, postures, point=target).motion_jacobian[:, :, :, 2] @ motor_motion(
        model
    )
    whole = np.linalg.svd(jacobian * np.repeat([1.0, model.reach], 3)[:, None], compute_uv=False)[:, -1]
    if model.n < 6 or not whole.max() > 0:
        whole = np.linalg.svd(jacobian[:, :3], compute_uv=False)[:, -1]
    lower, upper = joint_ranges(model)
    room = (np.minimum(postures - lower, upper - postures) / (upper - lower)).min(axis=1)
    return postures[int(np.argmax(whole * room))]


def other_postures(model: RobotModel, start: np.ndarray) -> np.ndarray:
    """32 further postures (32, n), the nearest to `start` (n,) first."""
    others = low_discrepancy_configurations(model, _OTHER_STARTS)
    return others[np.argsort(np.linalg.norm(others - start, axis=1))]


def inverse_kinematics_from_postures(
    model: RobotModel, aim: ToolPoseTarget, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inverse kinematics (N, n) from `start` (n,); masks (N,) of targets reached, and of those reached only from another posture.

    Where it ends before its aim, 32 other postures are tried, the nearest to `start` first.
    """
    q, reached = inverse_kinematics(model, aim, np.tile(start, (len(aim.position), 1)))
    first = reached.copy()
    for other in other_postures(model, start):
        rows = np.flatnonzero(~reached)
        if not len(rows):
            break
        solution, there = inverse_kinematics(model, aim.subset(rows), np.tile(other, (len(rows), 1)))
        q[rows[there]] = solution[there]
        reached[rows[there]] = True
    return q, reached, reached & ~first
