"""Check that the torques of logs are those of the joints."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.dynamics import JointLog
from flexcal.errors import InputError
from flexcal.model import RobotModel


def require_joint_torques(logs: Sequence[JointLog], model: RobotModel) -> None:
    """Raises `InputError` for a log of torques that are the motors' own, or of the other sign."""
    for log in logs:
        joint = log.weight.reversed
        if joint is not None:
            raise InputError(
                f"{log.path}: the torque of {model.joint_names[joint]} has the sign of its gravity torque instead of the "
                "opposite; change its sign by "
                "`tau: {gain: […]}` under `signals:`, or correct `gravity:` in robot.yaml."
            )
        if log.weight.by_motors:
            raise InputError(
                f"{log.path}: the torque of {model.joint_names[log.weight.heaviest]} is only {log.weight.share:.2%} of its "
                "gravity torque; these look "
                "like torques on the motor side: declare gear ratios as `tau: {gain: […]}` under `signals:`."
            )
