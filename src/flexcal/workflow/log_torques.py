"""Check that the torques of logs are those of the joints, by the weight of the links."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from flexcal.dynamics import JointLog
from flexcal.errors import InputError
from flexcal.model import RobotModel

_OVERRIDE = (
    "; where springs balance the arm, declare them under `dynamics: joint_springs:`, and where its masses in the URDF are guesses, go on "
    "with --accept weight"
)


def weight_faults(logs: Sequence[JointLog], model: RobotModel) -> Iterator[str]:
    """A sentence for every log of torques that are the motors' own, or of the other sign."""
    for log in logs:
        joint = log.weight.reversed
        if joint is not None:
            yield (
                f"{log.path}: the torque of {model.joint_names[joint]} has the sign of its gravity torque instead of the "
                "opposite; change its sign by "
                "`tau: {gain: […]}` under `signals:`, or correct `gravity:` in robot.yaml"
            )
        elif log.weight.by_motors:
            yield (
                f"{log.path}: the torque of {model.joint_names[log.weight.heaviest]} is only {log.weight.share:.2%} of its "
                "gravity torque; these look "
                "like torques on the motor side: declare gear ratios as `tau: {gain: […]}` under `signals:`"
            )


def require_joint_torques(logs: Sequence[JointLog], model: RobotModel) -> None:
    """Raises `InputError` for the first of the `weight_faults`."""
    for fault in weight_faults(logs, model):
        raise InputError(f"{fault}{_OVERRIDE}.")
