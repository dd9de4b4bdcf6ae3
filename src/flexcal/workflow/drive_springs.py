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

    Raises `InputError` for an `estimator` of rigid robots, for a robot without elastic joints, for a coupling of an elastic joint with a
    rigid one or with backlash, and for a log that lacks the arm side.
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
    elastic = {joint.name for joint in model.driven}
    gaps = {model.joint_names[joint] for joint in model.backlash_joints}
    for entry in model.config.drives.coupling:
        ends = {entry.motor, entry.joint}
        if len(ends & elastic) == 1:
            (one,), (other,) = ends & elastic, ends - elastic
            raise InputError(
                f"{model.path}: {one} is elastic and coupled with {other}, which is not; declare both under `elastic:`, or leave "
                "--flexible out."
            )
        if ends <= elastic and ends & gaps:
            raise InputError(
                f"{model.path}: {min(ends & gaps)} has backlash and a coupled motor, which the flexible model lacks; remove it from "
                "`geometry: backlash:`, or leave --flexible out."
            )
    for log in logs:
        if next(log_blocks(log, model)).arm is None:
            raise InputError(
                f"{log}: the columns qa1…qa{model.n} (positions on the arm side) are missing, which --flexible needs; record them, "
                "or leave --flexible out."
            )
    return springs
