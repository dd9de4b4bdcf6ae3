"""Requirements of the flexible model on a robot and its logs (Eqs. 2.21, 2.22)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flexcal.dynamics.estimators import EstimatorName
from flexcal.dynamics.inverse_model import BearingSpring, DriveSpring
from flexcal.dynamics.signals import log_blocks
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel

_LARGEST_TILT = 0.1
"""Largest tilt of a bearing, rad."""
_KNOWING: tuple[EstimatorName, ...] = ("wls", "ols", "sdp", "irls")
"""Estimators that accept any equations, those of motors included; the others are for rigid robots."""


def require_flexible_drives(
    model: RobotModel, logs: Sequence[Path], estimator: EstimatorName
) -> tuple[DriveSpring, ...]:
    """Drives of the elastic joints.

    Raises `InputError` for an `estimator` of rigid robots, for a robot without elastic joints, for a coupling of an elastic joint with a
    rigid one or with backlash, and for a log that lacks the arm side.
    """
    if estimator not in _KNOWING:
        raise InputError(
            "E-RUN-023",
            f"--estimator {estimator} is for rigid robots; take one of {', '.join(_KNOWING)}, or leave --flexible out.",
        )
    if not model.driven:
        raise InputError(
            "E-RUN-024",
            f"{model.path} declares no elastic joint, which --flexible needs; add it under `elastic:`, or leave --flexible out.",
        )
    springs = tuple(DriveSpring(joint.index) for joint in model.driven)
    elastic = {joint.name for joint in model.driven}
    with_backlash = {model.joint_names[joint] for joint in model.backlash_joints}
    for entry in model.config.drives.coupling:
        ends = {entry.motor, entry.joint}
        if len(ends & elastic) == 1:
            (one,), (other,) = ends & elastic, ends - elastic
            raise InputError(
                "E-RUN-025",
                f"{model.path}: {one} is elastic and coupled with {other}, which is not; declare both under `elastic:`, or leave "
                "--flexible out.",
            )
        if ends <= elastic and ends & with_backlash:
            raise InputError(
                "E-RUN-026",
                f"{model.path}: {min(ends & with_backlash)} has backlash and a coupled motor, which the flexible model lacks; remove "
                "it from `geometry: backlash:`, or leave --flexible out.",
            )
    for log in logs:
        if next(log_blocks(log, model)).arm is None:
            raise InputError(
                "E-RUN-027",
                f"{log}: the columns qa1…qa{model.n} (positions on the arm side) are missing, which --flexible needs; record them, "
                "or leave --flexible out.",
            )
    return springs


def require_flexible_bearings(model: RobotModel, logs: Sequence[Path]) -> tuple[BearingSpring, ...]:
    """Bearing springs if the logs have the tilts; none otherwise.

    Raises `InputError` for tilts in some logs alone, about one axis alone, of no bearings, beside a force sensor, or larger than bearings
    tilt.
    """
    first = [next(log_blocks(log, model)) for log in logs]
    seen = [recording.tilt_x is not None or recording.tilt_y is not None for recording in first]
    if not any(seen):
        return ()
    for log, recording in zip(logs, first, strict=True):
        if recording.tilt_x is None or recording.tilt_y is None:
            raise InputError(
                "E-RUN-028",
                f"{log}: the columns qax1…qax{model.n} and qay1…qay{model.n} (tilts of the bearings about x and y) are not all there; "
                "record both in all logs, with zeros at joints without bearings, or remove them.",
            )
        largest = max(float(np.abs(recording.tilt_x).max()), float(np.abs(recording.tilt_y).max()))
        if largest > _LARGEST_TILT:
            raise InputError(
                "E-RUN-029",
                f"{log}: a bearing tilts by {largest:.3g} rad (qax, qay), farther than bearings do; check the unit, and subtract what the "
                "sensors read at rest.",
            )
    bearings = tuple(
        BearingSpring(joint.index, component)
        for joint in model.driven
        if joint.bearings
        for component in (0, 1)
    )
    if not bearings:
        raise InputError(
            "E-RUN-030",
            f"{model.path} declares no bearings, but the logs have their tilts (qax, qay); add `bearing_x:` and `bearing_y:` to the "
            "elastic joint.",
        )
    if model.force_sensor is not None:
        raise InputError(
            "E-RUN-031",
            f"{model.path} declares a force sensor, which the equations of the bearings' tilts lack; remove the columns qax and qay.",
        )
    return bearings
