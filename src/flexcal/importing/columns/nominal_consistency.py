"""Consistency of joint positions and measured points with the nominal robot, and corrections that would explain a misfit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import TYPE_CHECKING, Any

import numpy as np

from flexcal.data.tables import UNITS
from flexcal.importing.columns.assignment import ColumnAssignment
from flexcal.importing.tables import parse_name
from flexcal.model.kinematics import point_kinematics
from flexcal.units import DEGREE

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

DOUBTFUL = 0.05
"""Misfit relative to the reach from which the nominal robot contradicts the points."""
_ODD = 0.01
"""Misfit relative to the reach from which explanations are searched: a robot is seldom so far from its URDF, wherever the point may be."""
_MADE_GOOD = 0.2
"""Largest share of the misfit that remains with a valid explanation."""
_FEWEST = 6
_FEWEST_FROM_HAND = 9
"""Least number of poses: twice as many numbers as unknowns of an instrument on the hand and its object, less three."""
_FROM_HAND = (
    "they fit a point that stands still and is seen from the hand (eye-in-hand), which is not supported: measure a point on the tool with "
    "an instrument that stands still (a tracker, a fixed camera)"
)
_ROTATION = 0.1
"""Largest deviation of a matrix from a rotation, in lengths."""
_MOST_ROWS = 60
_MOST_JOINTS = 8
_TURNS = (0.0, np.pi / 2, -np.pi / 2, np.pi)
_WORDS = {"in": "inches", "ft": "feet"}
"""Units that are written as words."""
_SIZE = 0.02
"""Deviation of the size of points from the nominal robot's, relative, that is none of a robot."""
_ROUNDS = 20
_SOME_ROUNDS = 2
_ALIKE = 1.5


@dataclass(frozen=True)
class NominalMismatch:
    """Residuals (rms, m) of the best-fit registered nominal robot.

    point: its name; declared: where it is in its frame (m); moved: where it would have to be to fit best, and `moved_rms` what that leaves.
    proposal: what would explain a misfit, in words, and `options` to say so with --map; empty where nothing simple does, or none is needed.
    supported: False where what explains it is no data that flexcal can use.
    """

    rms: float
    moved_rms: float
    declared: np.ndarray
    moved: np.ndarray
    reach: float
    point: str = ""
    proposal: str = ""
    options: tuple[str, ...] = ()
    supported: bool = True

    @property
    def doubtful(self) -> bool:
        """Whether columns, units or signs are likely wrong: not even another place of the point makes it fit, or something else does."""
        return self.moved_rms > DOUBTFUL * self.reach or bool(self.proposal)


def check_nominal(
    model: RobotModel,
    q: np.ndarray,
    xyz: np.ndarray,
    placed: ColumnAssignment,
    *,
    point: str | None = None,
    points: ColumnAssignment | None = None,
) -> NominalMismatch | None:
    """Register the nominal robot at `q` (N, n) rad or m with points `xyz` (N, 3), m, of one station and target.

    Where that misses by more than a hundredth of the reach, joints counted the other way or from another zero, another order of the
    columns `placed` as q, points in a left-handed frame, and another unit of their columns `points` are tried. None with
    fewer than six rows: anything fits then.
    """
    if len(q) < _FEWEST:
        return None
    rows = np.unique(np.linspace(0, len(q) - 1, min(len(q), _MOST_ROWS)).astype(int))
    q, xyz = q[rows], xyz[rows]
    tool = _Tool(model, point)
    rms, _ = tool.miss(q, xyz, 1)
    moved_rms, shift = tool.miss(q, xyz, _ROUNDS)
    declared = model.point(point).xyz
    mismatch = NominalMismatch(
        rms, moved_rms, declared, declared + shift, model.reach, model.point(point).name
    )
    if moved_rms < _ODD * model.reach:
        return mismatch
    if len(q) >= _FEWEST_FROM_HAND and tool.miss_from_hand(q, xyz) < min(
        _MADE_GOOD * moved_rms, _ODD * model.reach
    ):
        return replace(mismatch, proposal=_FROM_HAND, supported=False)
    return _explained(model, tool, q, xyz, placed, points, mismatch)


@dataclass(frozen=True)
class _Tool:
    model: RobotModel
    point: str | None

    def miss(self, q: np.ndarray, xyz: np.ndarray, rounds: int) -> tuple[float, np.ndarray]:
        """Least rms distance (m) over rigid motions, and with more than one of the rounds over places of the point in its frame."""
        at = point_kinematics(self.model, q, point=self.point, jacobians=False)
        frame = at.orientation
        shift = np.zeros(3)
        left = np.zeros_like(xyz)
        for _ in range(rounds):
            expected = at.position + frame @ shift
            from_centre, to_centre = expected.mean(axis=0), xyz.mean(axis=0)
            u, _, vt = np.linalg.svd((xyz - to_centre).T @ (expected - from_centre))
            turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
            left = (xyz - to_centre) @ turn - (expected - from_centre)
            if rounds > 1:
                inward = (xyz - to_centre) @ turn + from_centre - at.position
                shift = np.einsum("nji,nj->i", frame, inward) / len(q)
        return float(np.sqrt(np.mean(np.sum(left**2, axis=1)))), shift

    def size(self, q: np.ndarray, xyz: np.ndarray) -> float:
        """Factor by which points (N, 3) have the nominal robot's size, by their distances from their middle."""
        expected = point_kinematics(self.model, q, point=self.point, jacobians=False).position
        own, there = (float(np.sqrt(((p - p.mean(axis=0)) ** 2).sum())) for p in (xyz, expected))
        return there / own if own > 0 else 1.0

    def miss_from_hand(self, q: np.ndarray, xyz: np.ndarray) -> float:
        """Least rms distance (m) with `xyz` seen by an instrument on the hand: p + R (X xyz + c) is one place, whatever X (3, 3) and c.

        Infinite where X is no rotation: then the points are something else.
        """
        at = point_kinematics(self.model, q, point=self.point, jacobians=False)
        turned = np.einsum("nij,nk->nijk", at.orientation, xyz).reshape(-1, 9)
        columns = [turned, at.orientation.reshape(-1, 3), np.tile(-np.eye(3), (len(q), 1))]
        system, left = np.concatenate(columns, axis=1), -at.position.reshape(-1)
        solution, _, rank, _ = np.linalg.lstsq(system, left, rcond=1e-9)
        turn = solution[:9].reshape(3, 3)
        if rank < system.shape[1] or np.abs(turn @ turn.T - np.eye(3)).max() > _ROTATION:
            return np.inf
        return float(np.sqrt(np.mean(np.sum((system @ solution - left).reshape(-1, 3) ** 2, axis=1))))


@dataclass(frozen=True, eq=False)
class _Change:
    """Another reading of the columns: their `order`, `signs` and `zeros` (rad) of the joints, points in a `mirrored` frame or a `unit`.

    `scale` is that unit in the one that was read, or, without a unit, another size of the points.
    """

    order: tuple[int, ...]
    signs: np.ndarray
    zeros: np.ndarray
    mirrored: bool = False
    unit: str = ""
    scale: float = 1.0

    def read(self, q: np.ndarray, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turned = self.signs * q[:, self.order] + self.zeros
        return turned, self.scale * (xyz * [1.0, 1.0, -1.0] if self.mirrored else xyz)


def _explained(
    model: RobotModel,
    tool: _Tool,
    q: np.ndarray,
    xyz: np.ndarray,
    placed: ColumnAssignment,
    points: ColumnAssignment | None,
    mismatch: NominalMismatch,
) -> NominalMismatch:
    """The misfit with the simplest explanation that makes good most of it, with the point where it was declared if one does so."""
    enough = min(_MADE_GOOD * mismatch.moved_rms, _ODD * model.reach)
    simple = [*_simple_changes(model), *_other_units(model, points)]
    for rounds in (1, _ROUNDS):
        for change in simple:
            if tool.miss(*change.read(q, xyz), rounds)[0] < enough:
                return replace(mismatch, **_said(model, placed, points, change))
    size = tool.size(q, xyz)
    if points is not None and abs(size - 1) > _SIZE:
        change = replace(simple[0], mirrored=False, scale=size)
        if tool.miss(*change.read(q, xyz), _ROUNDS)[0] < enough:
            return replace(mismatch, **_said(model, placed, points, change))
    if model.n <= _MOST_JOINTS:
        change = _signs_and_zeros(model, tool, q, xyz)
        if tool.miss(*change.read(q, xyz), _ROUNDS)[0] < enough:
            return replace(mismatch, **_said(model, placed, points, change))
    return mismatch


def _simple_changes(model: RobotModel) -> Iterator[_Change]:
    """A left-handed frame; one joint's sign; one joint's zero; another order of the columns."""
    n = model.n
    straight, ones, zeros = tuple(range(n)), np.ones(n), np.zeros(n)
    yield _Change(straight, ones, zeros, mirrored=True)
    for i in straight:
        yield _Change(straight, np.where(np.arange(n) == i, -1.0, 1.0), zeros)
    for i in _turning(model):
        for turn in _TURNS[1:]:
            yield _Change(straight, ones, np.where(np.arange(n) == i, turn, 0.0))
    for order in (straight[::-1], (*straight[1:], 0), (n - 1, *straight[:-1])):
        yield _Change(order, ones, zeros)
    for i, j in combinations(straight, 2):
        exchanged = list(straight)
        exchanged[i], exchanged[j] = j, i
        yield _Change(tuple(exchanged), ones, zeros)


def _other_units(model: RobotModel, points: ColumnAssignment | None) -> Iterator[_Change]:
    """Points in another unit than that in which they were read."""
    if points is None or points.unit not in UNITS["xyz"]:
        return
    for unit, size in UNITS["xyz"].items():
        if unit != points.unit:
            yield _Change(
                tuple(range(model.n)),
                np.ones(model.n),
                np.zeros(model.n),
                unit=_WORDS.get(unit, unit),
                scale=size / UNITS["xyz"][points.unit],
            )


def _turning(model: RobotModel) -> list[int]:
    """The joints whose zero is seen: not the first and the last, for instrument and point may be anywhere."""
    return [i for i in range(1, model.n - 1) if model.motor_joints[i].kind != "prismatic"]


def _signs_and_zeros(model: RobotModel, tool: _Tool, q: np.ndarray, xyz: np.ndarray) -> _Change:
    """The signs and zeros that fit best: all signs, quarter turns one joint at a time; the fewest changes among equals."""
    tried: list[tuple[float, _Change]] = []
    for combination in product((1.0, -1.0), repeat=model.n):
        change = _Change(tuple(range(model.n)), np.array(combination), np.zeros(model.n))
        rms = tool.miss(*change.read(q, xyz), _SOME_ROUNDS)[0]
        for _ in range(2):
            before = rms
            for i in _turning(model):
                for turn in _TURNS:
                    zeros = np.where(np.arange(model.n) == i, turn, change.zeros)
                    other = replace(change, zeros=zeros)
                    left = tool.miss(*other.read(q, xyz), _SOME_ROUNDS)[0]
                    if left < 0.9 * rms:
                        rms, change = left, other
            if rms > 0.99 * before:
                break
        tried.append((rms, change))
    least = min(rms for rms, _ in tried)
    alike = [change for rms, change in tried if rms <= _ALIKE * least]
    return min(alike, key=lambda change: np.sum(change.signs < 0) + 1.5 * np.sum(change.zeros != 0))


def _said(
    model: RobotModel, placed: ColumnAssignment, points: ColumnAssignment | None, change: _Change
) -> dict[str, Any]:
    """Values of `proposal` and `options` for a misfit explained by a change."""
    words, options = [], []
    if change.mirrored:
        words.append(
            "the points are in a left-handed frame: one of x, y, z has the opposite sign, or two are exchanged"
        )
    if change.scale != 1.0 and points is not None:
        words.append(
            f"the points fit this robot if they are in {change.unit}, but were read in {_WORDS.get(str(points.unit), points.unit)}"
            if change.unit
            else f"the points fit this robot if they are {change.scale:.3g} times as large: they are in another unit, whose exact "
            "factor is to be given (x=FACTOR*COLUMN), or the robot is of another size than in the URDF"
        )
    if change.unit and points is not None:
        options += [
            f"{axis}={change.scale * gain:.10g}*{column}[{points.unit}]"
            for axis, column, gain in zip("xyz", points.columns, points.gains, strict=True)
        ]
    if change.order != tuple(range(model.n)):
        words.append(
            f"the joints seem to be in another order: {', '.join(placed.columns[i] for i in change.order)}"
        )
    for i, joint in enumerate(model.motor_joints):
        sign, zero, source = change.signs[i], change.zeros[i], change.order[i]
        if sign < 0:
            words.append(f"{joint.name} seems to have the opposite sign")
        if zero:
            words.append(f"{joint.name} seems to be {abs(zero) / DEGREE:.0f} degrees off the URDF's zero")
        if sign < 0 or zero or source != i:
            options.append(f"q{i + 1}={_source(placed, source, sign, zero)}")
    return {"proposal": "; ".join(words), "options": tuple(options)}


def _source(placed: ColumnAssignment, i: int, sign: float, zero: float) -> str:
    """Column `i` as --map has it, with another sign, and a zero in rad."""
    column, unit = placed.columns[i], placed.units[i]
    gain = sign * placed.gains[i]
    offset = sign * placed.offsets[i] + zero / (DEGREE if unit == "deg" else 1.0)
    factor = "-" if gain == -1 else "" if gain == 1 else f"{gain:g}*"
    named = "" if parse_name(column).unit == unit else f"[{unit}]"
    return f"{factor}{column}{named}" + (f"{offset:+.10g}" if offset else "")
