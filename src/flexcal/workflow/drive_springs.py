"""Requirements of the flexible model on a robot and its logs (Eqs. 2.21, 2.22)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flexcal.dynamics import DriveSpring, log_blocks
from flexcal.errors import InputError
from flexcal.model import RobotModel
from flexcal.workflow.estimators import EstimatorName

_KNOWING: tuple[EstimatorName, ...] = ("wls", "ols", "sdp", "irls")
"""Estimators that take any equations, those of motors too; the others are of rigid robots."""


def drive_springs(
    model: RobotModel, logs: Sequence[Path], estimator: EstimatorName
) -> tuple[DriveSpring, ...]:
    """The drives of the elastic joints; bearings are outside the flexible model.

    Raises `InputError` for an `estimator` of rigid robots, for a robot without elastic joints, for one whose motors turn an elastic
    joint together, and for a log that lacks the arm side.
    """
    if estimator not in _KNOWING:
        raise InputError(
            f"--estimator {estimator} is for rigid robots; take one of {', '.join(_KNOWING)}, or leave --flexible out."
        )
    if not model.driven:
        raise InputError(
            f"{model.path} declares no elastic joint, which --flexible needs; add it under `elastic:`, or leave --flexible out."
        )
    springs = tuple(DriveSpring(joint.index) for joint in model.driven)
    for entry in model.config.drives.coupling:
        for joint in model.driven:
            if joint.name in (entry.motor, entry.joint):
                raise InputError(
                    f"{model.path}: {joint.name} is elastic and coupled with another motor, which the flexible "
                    "model lacks; leave --flexible out."
                )
    for log in logs:
        if next(log_blocks(log, model)).arm is None:
            raise InputError(
                f"{log}: the columns qa1…qa{model.n} (positions on the arm side) are missing, which --flexible needs; record them, "
                "or leave --flexible out."
            )
    return springs
