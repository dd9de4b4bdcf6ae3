"""Whether joint positions and measured points can belong to this robot, and if not, what would make them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from flexcal.importing.column_names import parse_name
from flexcal.importing.placed_columns import PlacedColumns
from flexcal.model import point_kinematics
from flexcal.units import DEGREE, MILLIMETRE

if TYPE_CHECKING:
    from flexcal.model import RobotModel

DOUBTFUL = 0.05
"""Share of the reach from which on the nominal robot does not go with the points."""
_ODD = 0.01
"""Share from which on an explanation is looked for: a robot is seldom so far from its URDF, wherever the point may be."""
_MADE_GOOD = 0.2
"""What explains a misfit leaves less than this share of it."""
_FEWEST = 6
_MOST_ROWS = 60
_MOST_JOINTS = 8
_TURNS = (0.0, np.pi / 2, -np.pi / 2, np.pi)
_ROUNDS = 20
_SOME_ROUNDS = 2
_ALIKE = 1.5


@dataclass(frozen=True)
class Misfit:
    """By how much (rms, m) the registered nominal robot misses the points.

    moved: where in its frame (m) the point would have to be to fit best, and `moved_rms` what that leaves. proposal: what would explain
    a misfit, in words, and `options` to say so with --map; empty where nothing simple does, or none is needed.
    """

    rms: float
    moved_rms: float
    moved: np.ndarray
    reach: float
    proposal: str = ""
    options: tuple[str, ...] = ()

    @property
    def doubtful(self) -> bool:
        """Whether columns, units or signs are likely wrong: not even another place of the point makes it fit, or something else does."""
        return self.moved_rms > DOUBTFUL * self.reach or bool(self.proposal)


def check_nominal(
    model: RobotModel, q: np.ndarray, xyz: np.ndarray, placed: PlacedColumns, *, point: str | None = None
) -> Misfit | None:
    """Lay the nominal robot at `q` (N, n) rad or m through points `xyz` (N, 3), m, of one station and target.

    Where that misses by more than a hundredth of the reach, joints counted the other way or from another zero, another order of the
    columns `placed` as q, and points in a left-handed frame are tried. None with fewer than six rows: anything fits then.
    """
    if len(q) < _FEWEST:
        return None
    rows = np.unique(np.linspace(0, len(q) - 1, min(len(q), _MOST_ROWS)).astype(int))
    q, xyz = q[rows], xyz[rows]
    tool = _Tool(model, point)
    rms, _ = tool.miss(q, xyz, 1)
    moved_rms, shift = tool.miss(q, xyz, _ROUNDS)
    found = Misfit(rms, moved_rms, model.point(point).xyz + shift, model.reach)
    if moved_rms < _ODD * model.reach:
        return found
    return _explained(model, tool, q, xyz, placed, found)


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


def _explained(
    model: RobotModel, tool: _Tool, q: np.ndarray, xyz: np.ndarray, placed: PlacedColumns, found: Misfit
) -> Misfit:
    """The misfit with the simplest explanation that makes good most of it."""
    enough = min(_MADE_GOOD * found.moved_rms, _ODD * model.reach)

    def fits(joints: np.ndarray, points: np.ndarray) -> bool:
        return tool.miss(joints, points, _ROUNDS)[0] < enough

    if fits(q, xyz * [1.0, 1.0, -1.0]):
        return replace(
            found, proposal="the points are in a left-handed frame: one of x, y, z counts the other way"
        )
    for order in _orders(model.n):
        if fits(q[:, order], xyz):
            columns = [placed.columns[i] for i in order]
            text = f"the joints seem to stand in another order: {', '.join(columns)}"
            return replace(found, proposal=text, options=_options(placed, order, None, None, model))
    best = _signs_and_zeros(model, tool, q, xyz)
    if best is not None and fits(best[0] * q + best[1], xyz):
        words, signs, zeros = [], *best
        for i, joint in enumerate(model.joints):
            if signs[i] < 0:
                words.append(f"{joint.name} seems to be counted the other way")
            if zeros[i]:
                words.append(
                    f"{joint.name} seems to be {abs(zeros[i]) / DEGREE:.0f} degrees from the URDF's zero"
                )
        return replace(found, proposal="; ".join(words), options=_options(placed, None, signs, zeros, model))
    return found


def _orders(n: int) -> Iterator[list[int]]:
    """Other orders of n columns: turned round, the first at the end, two exchanged."""
    straight = list(range(n))
    yield straight[::-1]
    yield [*straight[1:], 0]
    yield [n - 1, *straight[:-1]]
    for i in range(n):
        for j in range(i + 1, n):
            order = straight.copy()
            order[i], order[j] = j, i
            yield order


def _signs_and_zeros(
    model: RobotModel, tool: _Tool, q: np.ndarray, xyz: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Signs (n,) and zeros (n,), rad, that fit best: all signs, quarter turns one joint at a time; the fewest changes among equals.

    The zeros of the first joint and of the last are not seen where the instrument's frame and the point's place are free.
    """
    if model.n > _MOST_JOINTS:
        return None
    revolute = [i for i, joint in enumerate(model.joints) if joint.kind != "prismatic"]
    tried: list[tuple[float, np.ndarray, np.ndarray]] = []
    for combination in product((1.0, -1.0), repeat=model.n):
        signs, zeros = np.array(combination), np.zeros(model.n)
        rms = tool.miss(signs * q, xyz, _SOME_ROUNDS)[0]
        for _ in range(2):
            before = rms
            for i in revolute[1:-1]:
                for turn in _TURNS:
                    other = zeros.copy()
                    other[i] = turn
                    left = tool.miss(signs * q + other, xyz, _SOME_ROUNDS)[0]
                    if left < 0.9 * rms:
                        rms, zeros = left, other
            if rms > 0.99 * before:
                break
        tried.append((rms, signs, zeros))
    least = min(rms for rms, _, _ in tried)
    alike = [(signs, zeros) for rms, signs, zeros in tried if rms <= _ALIKE * least]
    return min(alike, key=lambda item: np.sum(item[0] < 0) + 1.5 * np.sum(item[1] != 0))


def _options(
    placed: PlacedColumns,
    order: list[int] | None,
    signs: np.ndarray | None,
    zeros: np.ndarray | None,
    model: RobotModel,
) -> tuple[str, ...]:
    """What to write behind --map for the joints that change."""
    texts = []
    for i in range(model.n):
        source = i if order is None else order[i]
        sign = -1.0 if signs is not None and signs[i] < 0 else 1.0
        zero = 0.0 if zeros is None else zeros[i]
        if source == i and sign > 0 and not zero:
            continue
        unit = placed.units[source]
        scale = DEGREE if unit == "deg" else MILLIMETRE if unit == "mm" else 1.0
        gain = sign * placed.gains[source]
        offset = sign * placed.offsets[source] + zero / scale
        factor = "-" if gain == -1 else "" if gain == 1 else f"{gain:g}*"
        column = placed.columns[source]
        text = f"q{i + 1}={factor}{column}" + ("" if parse_name(column).unit == unit else f"[{unit}]")
        texts.append(text + (f"{offset:+.10g}" if offset else ""))
    return tuple(texts)
