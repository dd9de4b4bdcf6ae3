"""Columns of a force sensor in logs."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.dynamics import JointLog
from flexcal.errors import InputError
from flexcal.model import RobotModel


def require_wrenches(logs: Sequence[JointLog], model: RobotModel) -> None:
    """Raises `InputError` for a log without the columns of the force sensor that robot.yaml declares."""
    for log in logs:
        if model.force_sensor is not None and not log.wrench:
            raise InputError(
                f"{log.path}: robot.yaml declares a force sensor, but the columns fx, fy, fz, mx, my, mz are missing, so what acts beyond "
                "it is unknown; add them, or remove `force_sensor:` if nothing is beyond it."
            )


def require_no_wrenches(logs: Sequence[JointLog]) -> None:
    """Raises `InputError` for a log with the columns of a force sensor, which carries the payload and so takes it out of the torques."""
    for log in logs:
        if log.wrench:
            raise InputError(
                f"{log.path}: the force sensor's columns (fx, …) contain the payload, which would be taken out of the torques with them; "
                "remove these columns."
            )
