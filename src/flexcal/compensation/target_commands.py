"""Motor commands for tool targets."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from flexcal.compensation.desired_poses import desired_pose, spare_joints
from flexcal.compensation.failure_reasons import given_past_limit, nominal_reasons, real_reasons
from flexcal.compensation.inverse_kinematics import inverse_kinematics
from flexcal.compensation.newton_search import solve_commands
from flexcal.compensation.partial_orientation import partly_oriented
from flexcal.compensation.start_postures import (
    best_posture,
    inverse_kinematics_from_postures,
    other_postures,
)
from flexcal.data.poses import ToolTargets
from flexcal.model.robot import RobotModel
from flexcal.model.statics import carried_mass, certain_flank
from flexcal.progress import Progress, silent

_BLOCK = 8192
"""Number of rows solved together: their memory is a few tens of megabytes."""


@dataclass(frozen=True, eq=False)
class MotorCommands:
    """Motor commands for N targets of an n-joint robot.

    `q` (N, n) rad or m, NaN where there is none; `nominal` (N, n): what the nominal robot would be commanded; `before` (N,) m: how far the
    real tool would be from its target then (NaN where the nominal robot cannot get there); `unambiguous` (N,): the flank of every backlash
    is certain at the command; `elsewhere` (N,): nominal inverse kinematics got there from another posture than the start only, so that the
    arm may stand in another configuration; `reason` (N,) why there is no command, empty where there is one.
    """

    q: np.ndarray
    nominal: np.ndarray
    before: np.ndarray
    unambiguous: np.ndarray
    elsewhere: np.ndarray
    reason: np.ndarray

    @property
    def reached(self) -> np.ndarray:
        """Mask (N,) of targets with a command."""
        return self.reason == ""


def motor_commands(
    model: RobotModel,
    nominal: RobotModel,
    targets: ToolTargets,
    *,
    start: np.ndarray | None = None,
    progress: Progress = silent,
) -> MotorCommands:
    """Commands with which the calibrated `model` brings its tool to `targets`; `nominal` is the robot before calibration.

    The nominal inverse kinematics starts from the targets' own joint positions, else from `start` (n,), and Newton's method on `model` from
    there, so that the arm keeps its configuration. What the tool is to keep beside its position is in `desired_pose`. Raises `FlexcalError`
    for an unknown target or station, and as `tool_at_rest` does; a target that cannot be reached is no error, but gets a reason.
    """
    if targets.q is None and start is None:
        start = best_posture(nominal, str(targets.target[0]))
    parts = []
    for first in range(0, len(targets), _BLOCK):
        progress("compensating", first / len(targets))
        parts.append(_solve(model, nominal, targets.subset(slice(first, first + _BLOCK)), start))
    progress("compensating", 1.0)
    joined = {
        f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(MotorCommands)
    }
    return MotorCommands(**joined)


def _solve(
    model: RobotModel, nominal: RobotModel, targets: ToolTargets, start: np.ndarray | None
) -> MotorCommands:
    """`motor_commands` for a block of rows."""
    size = len(targets)
    aim = desired_pose(model, nominal, targets)
    elsewhere = np.zeros(size, dtype=bool)
    reason = np.full(size, "", dtype=object)
    spare = spare_joints(model, targets)
    if spare is not None:
        starts = [] if start is None else [start, *other_postures(nominal, start)]
        had = partly_oriented(nominal, aim, spare, starts if targets.q is None else [targets.q])
        aim, known, reached, elsewhere, reason = had.aim, had.q, had.reached, had.elsewhere, had.reason
    elif targets.q is not None:
        known, reached = inverse_kinematics(nominal, aim, targets.q)
    else:
        assert start is not None
        known, reached, elsewhere = inverse_kinematics_from_postures(nominal, aim, start)
    q, before = np.full((size, model.n), np.nan), np.full(size, np.nan)
    unambiguous = np.zeros(size, dtype=bool)
    if targets.q is not None:
        past = given_past_limit(nominal, targets.q)
        reason = np.where(past == "", reason, past)
    lost = np.flatnonzero(~reached & (reason == ""))
    reason[lost] = nominal_reasons(nominal, aim.subset(lost), known[lost])
    rows = np.flatnonzero(reason == "")
    commands = solve_commands(
        model,
        aim.subset(rows),
        known[rows],
        targets.payload if targets.payload is None else targets.payload[rows],
        targets.temperature if targets.temperature is None else targets.temperature[rows],
    )
    before[rows] = np.linalg.norm(commands.before[:, :3], axis=1)
    failed = ~commands.reached
    reason[rows[failed]] = real_reasons(
        model, aim.subset(rows[failed]), known[rows[failed]], commands.subset(failed)
    )
    done = rows[commands.reached]
    q[done] = commands.q[commands.reached]
    certain = certain_flank(
        model, q[done], commands.torque[commands.reached], carried_mass(model, targets.payload, size)[done]
    )
    unambiguous[done] = certain[:, list(model.backlash_joints)].all(axis=1)
    return MotorCommands(q, known, before, unambiguous, elsewhere, reason)
