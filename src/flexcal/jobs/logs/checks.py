"""Checks of joint logs: payload column, force sensor's columns, and torques against gravity."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from flexcal.dynamics.signals import JointLog
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel


def payload_masses(logs: Sequence[JointLog], model: RobotModel) -> list[float]:
    """Payload masses, kg, one per log; 0 if robot.yaml declares none. Raises `InputError` for a log without a declared payload's state."""
    return [_payload(log, model) for log in logs]


def _payload(log: JointLog, model: RobotModel) -> float:
    if model.payload is None:
        return 0.0
    if log.payload is None:
        raise InputError(
            "E-RUN-057",
            f"{log.path}: a payload is declared in {model.path.name}, but the log does not say whether it was held; add a column "
            "'payload' (kg; 0 without it).",
        )
    return log.payload


def require_unloaded(logs: Sequence[JointLog], model: RobotModel) -> None:
    """Raise `InputError` for a log recorded with a payload."""
    for log, payload in zip(logs, payload_masses(logs, model), strict=True):
        if payload > 0:
            raise InputError(
                "E-RUN-058",
                f"{log.path}: recorded with a payload of {payload:g} kg, but the robot's own dynamics need logs without; give both kinds "
                "to 'flexcal identify gains'.",
            )


def require_wrenches(logs: Sequence[JointLog], model: RobotModel) -> None:
    """Raise `InputError` for a log without the columns of the force sensor that robot.yaml declares."""
    for log in logs:
        if model.force_sensor is not None and not log.wrench:
            raise InputError(
                "E-RUN-059",
                f"{log.path}: robot.yaml declares a force sensor, but the columns fx, fy, fz, mx, my, mz are missing, so what acts beyond "
                "it is unknown; add them, or remove `force_sensor:` if nothing is beyond it.",
            )


def require_no_wrenches(logs: Sequence[JointLog]) -> None:
    """Raise `InputError` for a log with columns of a force sensor, which measures the payload and so removes it from the torques."""
    for log in logs:
        if log.wrench:
            raise InputError(
                "E-RUN-060",
                f"{log.path}: the force sensor's columns (fx, …) contain the payload, which would be taken out of the torques with them; "
                "remove these columns.",
            )


_OVERRIDE = (
    "; where springs balance the arm, declare them under `dynamics: joint_springs:`, and where its masses in the URDF are guesses, go on "
    "with --accept weight"
)


def weight_faults(logs: Sequence[JointLog], model: RobotModel) -> Iterator[str]:
    """One sentence for every log whose torques are motor-side or of opposite sign."""
    for log in logs:
        joint = log.weight.reversed
        if joint is not None:
            yield (
                f"{log.path}: the torque of {model.joint_names[joint]} has the sign of its gravity torque instead of the "
                f"opposite: its sign is reversed; change its sign by `tau: {{gain: […]}}` under `signals:`, or by "
                f"--map 'tau{joint + 1}=-COLUMN' where the file was imported, or correct `gravity:` in robot.yaml"
            )
        elif log.weight.on_motor_side:
            yield (
                f"{log.path}: the torque of {model.joint_names[log.weight.heaviest]} is only {log.weight.share:.2%} of its "
                "gravity torque; these look "
                "like torques on the motor side: declare gear ratios as `tau: {gain: […]}` under `signals:`"
            )


def require_joint_torques(logs: Sequence[JointLog], model: RobotModel) -> None:
    """Raise `InputError` for the first of the `weight_faults`."""
    for fault in weight_faults(logs, model):
        raise InputError("E-RUN-061", f"{fault}{_OVERRIDE}.")
