"""Joint positions of the nominal robot at poses."""

from __future__ import annotations

import numpy as np

from flexcal.compensation.failure_reasons import nominal_reasons
from flexcal.compensation.inverse_kinematics import inverse_kinematics
from flexcal.compensation.tool_target import ToolPoseTarget
from flexcal.model.robot import RobotModel


def nominal_joint_positions(
    nominal: RobotModel, aim: ToolPoseTarget, start: np.ndarray
) -> tuple[np.ndarray, list[str]]:
    """Joint positions (N, n) of the undeflected robot at every pose, from `start` (N, n); and why it cannot be there, or empty."""
    q, reached = inverse_kinematics(nominal, aim, start)
    reasons = [""] * len(q)
    lost = np.flatnonzero(~reached)
    for row, reason in zip(lost.tolist(), nominal_reasons(nominal, aim.subset(lost), q[lost]), strict=True):
        reasons[row] = reason
    return q, reasons
