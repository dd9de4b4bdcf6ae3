"""Whether joint positions can be in the unit they claim."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.signals import Signal
from flexcal.data.table import Table
from flexcal.units import DEGREE, MILLIMETRE

if TYPE_CHECKING:
    from flexcal.model import RobotModel


def check_joint_units(model: RobotModel, table: Table, signal: Signal, q: np.ndarray) -> None:
    """Raise `InputError` with row and column of the first position (N, n) that lies far past the joint's limits.

    Far is more than half the joint's range (at least 0.5 rad or m) past a limit; a joint without limits has ±2π.
    """
    lower = np.array([joint.lower for joint in model.joints])
    upper = np.array([joint.upper for joint in model.joints])
    lower = np.where(np.isfinite(lower), lower, -2 * np.pi)
    upper = np.where(np.isfinite(upper), upper, 2 * np.pi)
    margin = np.maximum(0.5 * (upper - lower), 0.5)
    far = (q < lower - margin) | (q > upper + margin)
    if not far.any():
        return
    row = int(np.argmax(far.any(axis=1)))
    column = int(np.argmax(far[row]))
    joint, value = model.joints[column], q[row, column]
    prismatic = getattr(joint, "kind", "revolute") == "prismatic"
    unit, other, word = ("m", "mm", "millimetres") if prismatic else ("rad", "deg", "degrees")
    scaled = q * (MILLIMETRE if prismatic else DEGREE)
    likely = not ((scaled < lower - margin) | (scaled > upper + margin))[:, column].any()
    limits = f"{value:g} {unit} is far past the limits of {joint.name} ({lower[column]:.4g} to {upper[column]:.4g} {unit})"
    advice = (
        f"these look like {word}: convert them to {unit}, or declare 'unit: {other}' under `signals:`."
        if likely
        else "check the unit and the order of the columns."
    )
    raise table.error(row, signal.column_of(column), f"{limits}; {advice}")
