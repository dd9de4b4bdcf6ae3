"""Check of joint positions against the limits, and of their unit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.tables.following_joints import check_following_joints
from flexcal.data.tables.signals import Signal
from flexcal.data.tables.tabular_file import Table
from flexcal.units import DEGREE, MILLIMETRE

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel


def check_joint_units(model: RobotModel, table: Table, signal: Signal, q: np.ndarray) -> None:
    """Raise `InputError` with row and column of the first position (N, n) that lies far past the joint's limits.

    Far is more than half the joint's range (at least 0.5 rad or m) past a limit; a joint without limits has ±2π. Joints that follow others
    are checked too, as `check_following_joints` does.
    """
    lower = np.array([joint.lower for joint in model.motor_joints])
    upper = np.array([joint.upper for joint in model.motor_joints])
    lower = np.where(np.isfinite(lower), lower, -2 * np.pi)
    upper = np.where(np.isfinite(upper), upper, 2 * np.pi)
    margin = np.maximum(0.5 * (upper - lower), 0.5)
    far = (q < lower - margin) | (q > upper + margin)
    if not far.any():
        check_following_joints(model, table, signal.column_of(0), q)
        return
    row = int(np.argmax(far.any(axis=1)))
    column = int(np.argmax(far[row]))
    joint, value = model.motor_joints[column], q[row, column]
    prismatic = getattr(joint, "kind", "revolute") == "prismatic"
    unit, other, word = ("m", "mm", "millimetres") if prismatic else ("rad", "deg", "degrees")
    scaled = q * (MILLIMETRE if prismatic else DEGREE)
    likely = not ((scaled < lower - margin) | (scaled > upper + margin))[:, column].any()
    limits = f"{value:g} {unit} is far past the limits of {joint.name} ({lower[column]:.4g} to {upper[column]:.4g} {unit})"
    factor = signal.factor[column] if signal.matrix is None else 0.0
    advice = (
        f"it is converted to {unit} already: the controller may count the joint from another zero or the other way round, which "
        "`offset:` and `gain:` under `signals:` say, or --map of import; or the columns are in another order."
        if abs(factor) != 1.0
        else f"these look like {word}: convert them to {unit}, or declare 'unit: {other}' under `signals:`."
        if likely
        else "check the unit and the order of the columns."
    )
    raise table.error("E-TABLE-001", row, signal.column_of(column), f"{limits}; {advice}")


def check_joint_limits(
    model: RobotModel,
    table: Table,
    rows: Sequence[int] | np.ndarray,
    columns: Sequence[str],
    q: np.ndarray,
    room: np.ndarray | float = 0.0,
) -> None:
    """Raise `InputError` with row, column, pose and joint of the first position of `q` (N, n) outside its limits.

    `rows` (N,) and `columns` (n,) say where it stands in the table, whose column `pose` names it; `room` (n,), rad or m: how much must
    be free on either side for what moves about the pose.
    """
    need = np.broadcast_to(room, q.shape[1:])
    lower = np.array([joint.lower for joint in model.motor_joints])
    upper = np.array([joint.upper for joint in model.motor_joints])
    outside = (q < lower + need) | (q > upper - need)
    if not outside.any():
        return
    row, joint = (int(i) for i in np.argwhere(outside)[0])
    name = table.columns["pose"][rows[row]]
    pose = f"pose {name}" if isinstance(name, str) else f"pose {name:g}"
    unit = "m" if model.motor_joints[joint].kind == "prismatic" else "rad"
    limits = f"limits of {model.motor_joints[joint].name} ({lower[joint]:.5g} to {upper[joint]:.5g} {unit})"
    if need[joint]:
        what = f"{pose}, at {q[row, joint]:.5g} {unit}, leaves less than the {need[joint]:.3g} {unit} that it needs to the {limits}"
    else:
        what = f"{pose}, at {q[row, joint]:.5g} {unit}, is outside the {limits}"
    raise table.error(
        "E-TABLE-002", int(rows[row]), columns[joint], f"{what}; choose another pose, or correct the URDF."
    )
