"""Motor commands for tool targets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.compensation.desired_poses import desired_pose, spare_joints
from flexcal.compensation.failure_reasons import given_past_limit, nominal_reasons, real_reasons
from flexcal.compensation.inverse_kinematics import inverse_kinematics
from flexcal.compensation.newton_search import CommandSearch
from flexcal.compensation.partial_orientation import partly_oriented
from flexcal.compensation.start_postures import (
    best_posture,
    inverse_kinematics_from_postures,
    other_postures,
)
from flexcal.data.poses import ToolTargets
from flexcal.model.robot import RobotModel
from flexcal.model.statics import are_flanks_certain, carried_mass
from flexcal.progress import Progress, silent

_BLOCK = 4096
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
    found = _nothing(len(targets), model.n)
    lost: list[_Rows] = []
    for first in range(0, len(targets), _BLOCK):
        progress("compensating", first / len(targets))
        block = np.arange(first, min(first + _BLOCK, len(targets)))
        done, left = _stepped(found, block, model, nominal, targets, start).parted()
        _take(found, done, targets)
        if lost and (left.search.aim.rows != lost[0].search.aim.rows or _count(lost) >= _BLOCK):
            _take_damped(found, lost, targets)
            lost = []
        lost.append(left)
    if lost:
        _take_damped(found, lost, targets)
    progress("compensating", 1.0)
    return found


@dataclass(frozen=True, eq=False)
class _Rows:
    """The search for the targets with some numbers (N,)."""

    number: np.ndarray
    search: CommandSearch

    def parted(self) -> tuple[_Rows, _Rows]:
        """Those that Newton's steps settled, and those that they lost."""
        lost = self.search.lost
        settled, left = (_Rows(self.number[rows], self.search.subset(rows)) for rows in (~lost, lost))
        return settled, left


def _count(parts: list[_Rows]) -> int:
    return sum(len(part.number) for part in parts)


def _nothing(size: int, joints: int) -> MotorCommands:
    """No commands yet."""
    q, nominal = np.full((2, size, joints), np.nan)
    unambiguous, elsewhere = np.zeros((2, size), dtype=bool)
    return MotorCommands(
        q, nominal, np.full(size, np.nan), unambiguous, elsewhere, np.full(size, "", dtype=object)
    )


def _stepped(
    found: MotorCommands,
    block: np.ndarray,
    model: RobotModel,
    nominal: RobotModel,
    every: ToolTargets,
    start: np.ndarray | None,
) -> _Rows:
    """The nominal commands of a block, left in `found`, and Newton's steps from them for the targets that have one."""
    targets = every.subset(slice(int(block[0]), int(block[-1]) + 1))
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
    if targets.q is not None:
        past = given_past_limit(nominal, targets.q)
        reason = np.where(past == "", reason, past)
    lost = np.flatnonzero(~reached & (reason == ""))
    reason[lost] = nominal_reasons(nominal, aim.subset(lost), known[lost])
    found.nominal[block], found.elsewhere[block], found.reason[block] = known, elsewhere, reason
    rows = np.flatnonzero(reason == "")
    payload, temperature = (
        None if values is None else values[rows] for values in (targets.payload, targets.temperature)
    )
    search = CommandSearch(model, aim.subset(rows), known[rows], payload, temperature)
    search.step()
    return _Rows(block[rows], search)


def _take(found: MotorCommands, rows: _Rows, targets: ToolTargets) -> None:
    """Leave the result of a search in `found`."""
    number, search = rows.number, rows.search
    found.before[number] = np.linalg.norm(search.before[:, :3], axis=1)
    found.reason[number[~search.reached]] = real_reasons(search.subset(~search.reached))
    done, there = number[search.reached], search.subset(search.reached)
    found.q[done] = there.q
    if targets.approach is not None:
        # the arm lags behind the last motion of its motors
        found.q[done] += targets.approach[done] * search.model.drives.hysteresis[list(search.model.motors)]
    mass = carried_mass(search.model, targets.payload, len(targets))[done]
    found.unambiguous[done] = are_flanks_certain(search.model, there.q, there.torque, mass)


def _take_damped(found: MotorCommands, lost: list[_Rows], targets: ToolTargets) -> None:
    """Seek what Newton's steps lost in several blocks, all at once: it takes many steps of few rows."""
    search = lost[0].search.joined([rows.search for rows in lost[1:]])
    search.try_damped()
    _take(found, _Rows(np.concatenate([rows.number for rows in lost]), search), targets)
