"""Corrections between the targets of straight motions and arcs, where the controller interpolates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.compensation import ToolPoseTarget, motor_commands, nominal_joint_positions
from flexcal.data.poses import ToolTargets
from flexcal.jobs.deployment.controller_poses import ControllerPoses
from flexcal.jobs.deployment.tool_paths import ToolPath
from flexcal.model.robot import RobotModel
from flexcal.programs import Move, NewNumbers, Pose, Program, ProgramTarget
from flexcal.units import MILLIMETRE

_SHARES = (0.25, 0.5, 0.75)
"""Where between its ends a path is looked at."""
_MOST = 64
"""Most parts of a divided line."""


@dataclass(frozen=True, eq=False)
class PathCorrections:
    """Corrections along the moves of a program, whose targets have joint positions `before` and `after` (N, 6), NaN where they stay.

    `masses` (N,), kg, are what the arm carries at the targets; None where robot.yaml knows of no payload.
    """

    model: RobotModel
    places: ControllerPoses
    program: Program
    before: np.ndarray
    after: np.ndarray
    masses: np.ndarray | None

    def deviations(self) -> np.ndarray:
        """Largest distance (M,), m, on every move between the needed pose of the tool and the interpolation of the corrected ends.

        NaN where a target stays as it is or its tool is not known, and where the arm cannot follow the path.
        """
        largest = np.full(len(self.program.moves), np.nan)
        rows = [k for k, move in enumerate(self.program.moves) if self._is_known(move)]
        if not rows:
            return largest
        moves = [self.program.moves[k] for k in rows for _ in _SHARES]
        shares = np.tile(_SHARES, len(rows))
        _, needed = self._needed(moves, shares)
        flange = _poses(self.places, needed)
        distances = np.full(len(moves), np.nan)
        paths = self._paths(moves, self.after)
        for k, (move, path, share, pose) in enumerate(zip(moves, paths, shares, flange, strict=True)):
            if pose is not None:
                distances[k] = path.distance((pose @ self._tool(move)).position, share)
        largest[rows] = distances.reshape(len(rows), -1).max(axis=1)
        return largest

    def divisions(self, deviations: np.ndarray, limit: float) -> dict[int, list[NewNumbers]]:
        """Corrected points to insert before the moves along lines whose `deviations` (M,) exceed the limit, m, so that the parts' do not.

        Every part is again looked at in its middle. Moves that cannot be divided are left out.
        """
        inserted = {}
        for index in np.flatnonzero(deviations > limit).tolist():
            move = self.program.moves[index]
            if move.via is not None or not self.program.can_insert(move):
                continue
            parts = int(np.ceil(np.sqrt(deviations[index] / limit)))
            while parts <= _MOST:
                shares = np.arange(1, 2 * parts) / (2 * parts)
                nominal, needed = self._needed([move] * len(shares), shares)
                if not np.isfinite(needed).all():
                    break
                if self._largest_of_parts(move, needed) <= limit:
                    target = [self.program.targets[move.end]] * (parts - 1)
                    inserted[index] = self.places.new_numbers(target, nominal[1::2], needed[1::2])
                    break
                parts += 1
        return inserted

    def _largest_of_parts(self, move: Move, needed: np.ndarray) -> float:
        """Largest distance, m, of the needed position in the middle of a part from the line between its ends."""
        ends = [self.after[move.start], *needed[1::2], self.after[move.end]]
        flange = _poses(self.places, np.array([*ends, *needed[::2]]))
        at = np.array([(pose @ self._tool(move)).position for pose in flange if pose is not None])
        corners, middles = at[: len(ends)], at[len(ends) :]
        return float(np.linalg.norm(middles - (corners[1:] + corners[:-1]) / 2, axis=1).max())

    def _is_known(self, move: Move) -> bool:
        ends = [k for k in (move.start, move.via, move.end) if k is not None]
        target = self.program.targets[move.end]
        has_tool = target.tool is not None or self.places.tool is not None
        return has_tool and bool(np.isfinite(self.after[ends]).all())

    def _tool(self, move: Move) -> Pose:
        tool = self.program.targets[move.end].tool or self.places.tool
        assert tool is not None
        return tool

    def _paths(self, moves: Sequence[Move], q: np.ndarray) -> list[ToolPath]:
        """Path of every move between targets at joint positions (N, 6), once for a move that is there several times."""
        paths = {id(move): move for move in moves}
        made = {key: self._path(move, q) for key, move in paths.items()}
        return [made[id(move)] for move in moves]

    def _path(self, move: Move, q: np.ndarray) -> ToolPath:
        """Path of the tool between targets at joint positions (N, 6)."""
        via = move.start if move.via is None else move.via
        start, middle, end = _poses(self.places, q[[move.start, via, move.end]])
        assert start is not None and middle is not None and end is not None
        tool = self._tool(move)
        return ToolPath(start @ tool, None if move.via is None else middle @ tool, end @ tool)

    def _needed(self, moves: Sequence[Move], shares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Joint positions (K, 6) of the nominal robot at shares of the nominal paths, and compensated ones; NaN where there are none."""
        aims, starts = [], []
        for move, path, share in zip(moves, self._paths(moves, self.before), shares, strict=True):
            aims.append(path.pose(share) @ self._tool(move).inverse())
            starts.append((1 - share) * self.before[move.start] + share * self.before[move.end])
        name = np.full(len(aims), self.places.flange)
        aim = ToolPoseTarget(
            name, np.array([each.position for each in aims]), np.array([each.rotation for each in aims])
        )
        nominal, reasons = nominal_joint_positions(self.places.nominal, aim, np.array(starts))
        needed = np.full_like(nominal, np.nan)
        rows = np.array([k for k, reason in enumerate(reasons) if not reason], dtype=int)
        if len(rows):
            masses = None if self.masses is None else self.masses[[moves[k].end for k in rows]]
            targets = ToolTargets(rows, name[rows], nominal[rows], payload=masses)
            commands = motor_commands(self.model, self.places.nominal, targets)
            lost = np.array([bool(reason) for reason in commands.reason])
            needed[rows] = np.where(lost[:, None], np.nan, commands.q)
        return nominal, needed


def deviations_of_targets(moves: Sequence[Move], deviations: np.ndarray, count: int) -> np.ndarray:
    """Largest deviation (count,), m, of the moves to every target; NaN where there is none."""
    largest = np.full(count, np.nan)
    for move, deviation in zip(moves, deviations, strict=True):
        largest[move.end] = np.fmax(largest[move.end], deviation)
    return largest


def path_remarks(
    program: Program,
    deviations: np.ndarray,
    limit: float | None,
    inserted: dict[int, list[NewNumbers]],
) -> tuple[str, ...]:
    """What is said of lines and arcs between the points: the largest deviation, points inserted, and moves that could not be divided."""
    if not np.isfinite(deviations).any():
        return ()
    worst = int(np.nanargmax(deviations))
    most = np.nanmax(deviations) / MILLIMETRE
    remarks = [
        f"between their points straight motions and arcs miss the needed correction by {most:.3f} mm at most, on "
        f"the way to {_named(program, program.moves[worst])}"
    ]
    if limit is None:
        return tuple(remarks)
    count, allowed = sum(map(len, inserted.values())), f"{limit / MILLIMETRE:g} mm"
    remarks.append(
        f"{count} points inserted in {len(inserted)} motions, after which lines miss it by {allowed} at most; they have the other "
        "arguments of the motion that they divide, so that the arm stops at each where that one has no blending"
        if count
        else f"no points inserted for {allowed}"
    )
    left = [k for k in np.flatnonzero(deviations > limit).tolist() if k not in inserted]
    if left:
        names = ", ".join(dict.fromkeys(_named(program, program.moves[k]) for k in left[:5]))
        more = f" and {len(left) - 5} more" if len(left) > 5 else ""
        remarks.append(
            f"not divided, though they miss it by more: the motions to {names}{more}; only plain lines are that begin a line of the program"
        )
    return tuple(remarks)


def _named(program: Program, move: Move) -> str:
    target: ProgramTarget = program.targets[move.end]
    return f"{target.name} (line {target.line})"


def _poses(places: ControllerPoses, q: np.ndarray) -> list[Pose | None]:
    """Poses of the flange at joint positions (K, 6); None where these are NaN."""
    known = np.asarray(np.isfinite(q).all(axis=1))
    position, rotation = places.poses(np.where(known[:, None], q, 0.0))
    return [Pose(position[k], rotation[k]) if known[k] else None for k in range(len(q))]
