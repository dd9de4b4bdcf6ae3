"""Payloads of logs."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.dynamics import JointLog
from flexcal.errors import InputError
from flexcal.model import RobotModel


def log_payloads(logs: Sequence[JointLog], model: RobotModel) -> list[float]:
    """kg, one a log; 0 where robot.yaml declares none. Raises `InputError` for a log that does not say, though one is declared."""
    return [_payload(log, model) for log in logs]


def _payload(log: JointLog, model: RobotModel) -> float:
    if model.payload is None:
        return 0.0
    if log.payload is None:
        raise InputError(
            f"{log.path}: a payload is declared in {model.path.name}, but the log does not say whether it was held; add a column "
            "'payload' (kg; 0 without it)."
        )
    return log.payload


def require_unloaded(logs: Sequence[JointLog], model: RobotModel) -> None:
    """Raises `InputError` for a log that was recorded with a payload."""
    for log, held in zip(logs, log_payloads(logs, model), strict=True):
        if held > 0:
            raise InputError(
                f"{log.path}: recorded with a payload of {held:g} kg, but the robot's own dynamics need logs without; give both kinds to "
                "'flexcal identify gains'."
            )
