"""Column names of Universal Robots' real-time interface: actual_q_0, target_moment_0 and so on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.importing.columns.assignment import ColumnAssignment
from flexcal.importing.columns.unit_inference import joint_units
from flexcal.importing.tables import ForeignTable

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

JOINTS = 6
TIME = "timestamp"
TOOL = tuple(f"actual_TCP_pose_{i}" for i in range(3))
"""Column names of the controller's tool position, m in the base frame; a rotation vector follows."""
_WHY = "names of Universal Robots' controllers"
_OF_JOINTS = (("dq", "actual_qd", "rad/s"), ("tau", "actual_current_as_torque", "N m"))
_REASONS = {
    "actual_current": "currents need a gain in N m/A: --map 'tau1=GAIN*actual_current_0[A]' and so on",
    "actual_current_window": "bounds of the currents",
    "joint_control_output": "currents commanded by the controller",
    "joint_temperatures": "one per joint, but a file has one temperature",
    "target_current": "computed by the controller's model, not measured",
    "target_moment": "computed by the controller's model, not measured",
    "target_q": "commanded by the controller",
    "target_qd": "commanded by the controller",
    "target_qdd": "commanded by the controller",
    "target_TCP_pose": "commanded by the controller",
    "target_TCP_speed": "of the tool, not of the joints",
    "actual_TCP_speed": "of the tool, not of the joints",
    "actual_TCP_force": "of the tool, not of the joints",
}
_TURN = "the rotation vector of the tool by the controller's own kinematics; it is not measured"
_IN_LOG = "tool pose computed by the controller from the joints, not measured"
_SLOWEST = 1.1
"""Longest time step of a log, s; rarer samples are poses."""


def rtde_columns(
    foreign: ForeignTable, model: RobotModel, reasons: dict[str, str]
) -> dict[str, ColumnAssignment]:
    """Assignment of columns with these names, positions of six joints among them; empty otherwise.

    The tool's position counts as a measured point only where no time says that this is a log. `reasons` gets the columns of that
    interface that are not imported.
    """
    there = foreign.numbers
    if model.n != JOINTS or not set(_of_joints("actual_q")) <= there.keys():
        return {}
    columns = _of_joints("actual_q")
    units = joint_units(model, np.stack([there[column] for column in columns], axis=1))
    assignments = {
        "q": ColumnAssignment.plain("q", columns, units, f"{_WHY}; the unit by the joints' limits")
    }
    for quantity, stem, unit in _OF_JOINTS:
        columns = _of_joints(stem)
        if set(columns) <= there.keys():
            assignments[quantity] = ColumnAssignment.plain(quantity, columns, (unit,) * JOINTS, _WHY)
    for stem, why in _REASONS.items():
        reasons |= {column: why for column in _of_joints(stem) if column in there}
    steps = []
    if TIME in there and TIME not in foreign.times:
        assignments["t"] = ColumnAssignment.plain("t", (TIME,), ("s",), _WHY)
    if TIME in there:
        steps = np.diff(there[TIME])
    if set(TOOL) <= there.keys():
        if len(steps) and np.median(steps) <= _SLOWEST:
            reasons |= dict.fromkeys(TOOL, _IN_LOG)
        else:
            assignments["xyz"] = ColumnAssignment.plain("xyz", TOOL, ("m",) * 3, f"{_WHY}; not measured")
        reasons |= {column: _TURN for column in _of_joints("actual_TCP_pose")[3:] if column in there}
    return assignments


def _of_joints(stem: str) -> tuple[str, ...]:
    return tuple(f"{stem}_{i}" for i in range(JOINTS))
