"""Checks of joints that follow others against a file: loops that close, limits, and their own angles where it has them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.tables.tabular_file import Table
from flexcal.model.kinematics import joint_positions, loop_gap
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_DIFFERENCE = 0.02
"""Largest difference, rad or m, between a measured position of a joint and what its relation says: deflection and errors stay below."""


def check_following_joints(model: RobotModel, table: Table, column: str, q: np.ndarray) -> None:
    """Raise `InputError` with the row where a loop does not close at the motors' `q` (N, n), whose first `column` is blamed, or where a
    joint that follows others was measured, in rad or m in a column of its name, elsewhere than it should be.
    """
    if model.relations is None or not len(q):
        return
    positions = joint_positions(model, q)
    open_ = ~np.isfinite(positions).all(axis=1)
    if open_.any():
        row = int(np.argmax(open_))
        loop, gap = loop_gap(model, q[row])
        angles = ", ".join(
            f"{name} at {value:.4g}" for name, value in zip(model.motor_names, q[row], strict=True)
        )
        raise table.error(
            "E-TABLE-041",
            row,
            column,
            f"the loop '{loop}' cannot close with {angles}: its frames stay {gap / MILLIMETRE:.3g} mm apart; correct the line, "
            "or `loops:` of robot.yaml.",
        )
    for i, joint in enumerate(model.joints):
        if i in model.motors or joint.name not in table.columns:
            continue
        apart = table.columns[joint.name] - positions[:, i]
        unit = "m" if joint.kind == "prismatic" else "rad"
        constant = float(np.median(apart))
        row = int(np.argmax(np.abs(apart - constant)))
        if abs(apart[row] - constant) > _DIFFERENCE:
            raise table.error(
                "E-TABLE-042",
                row,
                joint.name,
                f"{joint.name} was measured at {table.columns[joint.name][row]:.4g} {unit}, but by its relation to other joints it is at "
                f"{positions[row, i]:.4g} {unit}; correct `relations:` or `loops:` of robot.yaml, or <mimic> of the URDF.",
            )
        if abs(constant) > _DIFFERENCE:
            raise table.error(
                "E-TABLE-043",
                row,
                joint.name,
                f"{joint.name} was measured {constant:+.4g} {unit} from where its relation to other joints has it, in all lines alike; add "
                "that to the relation's `offset:`.",
            )
