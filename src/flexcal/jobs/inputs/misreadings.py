"""Explanations of a grossly wrong row: axes, signs and units of its point, and joint values or a point of another pose."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

_UNITS = ((1.0, ""), (1e-3, "mm given as m"), (1e3, "m given as mm"), (0.0254, "inches given as m"))
_CLEAR = 10.0
"""Factor by which an explanation must fit better than the row as it is, and than any other explanation."""
_SURELY = 0.005
"""Least distance, m, from which a row is taken for misread."""
_SAME = 1e-6
"""Difference of joint positions, rad or m, below which they are the same numbers."""


@dataclass(frozen=True)
class Misreading:
    """Explanation of a row: `kind`, in words, the distance `left` (m) that remains with it, and the number of the other `pose`, if any."""

    kind: str
    words: str
    left: float
    pose: int | None = None


def misread_point(measured: np.ndarray, expected: np.ndarray, tolerance: float) -> Misreading | None:
    """What was done to the `measured` point (3,), m, that is `expected` elsewhere, to `tolerance` m; None where nothing certain was."""
    off = float(np.linalg.norm(measured - expected))
    found: list[tuple[float, int, Misreading]] = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            for factor, unit in _UNITS:
                changes = (order != (0, 1, 2)) * 1 + sum(s < 0 for s in signs) + (factor != 1.0)
                if not changes:
                    continue
                point = factor * np.array(signs) * measured[list(order)]
                left = float(np.linalg.norm(point - expected))
                kind = "unit" if factor != 1.0 and changes == 1 else "axes"
                found.append((left, changes, Misreading(kind, _in_words(order, signs, unit), left)))
    found.sort(key=lambda item: item[:2])
    best, second = found[0], found[1]
    if off < _SURELY or best[0] > tolerance or best[0] * _CLEAR > off:
        return None
    if second[0] < _CLEAR * max(best[0], tolerance / _CLEAR):
        return None
    return best[2]


def other_pose(
    q: np.ndarray,
    measured: np.ndarray,
    expected: np.ndarray,
    rows_q: np.ndarray,
    rows_point: np.ndarray,
    rows_pose: np.ndarray,
    tolerance: float,
) -> Misreading | None:
    """Earlier row, whose joint values or whose point the row has: its q (n,) is equal, or its point within `tolerance` m.

    `expected` (3,), m, is where the point should be. None where the row is not surely off, or several fit.
    """
    off = float(np.linalg.norm(measured - expected))
    if off < max(_SURELY, _CLEAR * tolerance) or not len(rows_q):
        return None
    same_q = np.flatnonzero(np.abs(rows_q - q).max(axis=1) < _SAME)
    if len(same_q):
        pose = int(rows_pose[same_q[-1]])
        return Misreading("wrong_row", f"it has the joint values of pose {pose}", off, pose)
    apart = np.linalg.norm(rows_point - measured, axis=1)
    near = np.flatnonzero(apart < tolerance)
    if len(near) == 1:
        pose = int(rows_pose[near[0]])
        return Misreading("wrong_row", f"its point is that of pose {pose} again", float(apart[near[0]]), pose)
    return None


def planned_pose(
    measured: np.ndarray, expected: np.ndarray, planned: np.ndarray, numbers: np.ndarray, tolerance: float
) -> Misreading | None:
    """Planned pose, of those expected at `planned` (M, 3), m, to which a point belongs in place of its own; None for none or several."""
    off = float(np.linalg.norm(measured - expected))
    if off < max(_SURELY, _CLEAR * tolerance) or not len(planned):
        return None
    apart = np.linalg.norm(planned - measured, axis=1)
    near = np.flatnonzero(apart < tolerance)
    if len(near) != 1:
        return None
    pose = int(numbers[near[0]])
    return Misreading(
        "wrong_row", f"its point belongs to the planned pose {pose}", float(apart[near[0]]), pose
    )


def _in_words(order: tuple[int, ...], signs: tuple[float, ...], unit: str) -> str:
    """What was done to x, y and z."""
    moved = [k for k in range(3) if order[k] != k]
    wrong = [k for k in range(3) if signs[k] < 0]
    parts = []
    if len(moved) == 2:
        parts.append(f"{' and '.join('xyz'[k] for k in moved)} are swapped")
    elif moved:
        parts.append(f"x, y, z stand in the columns of {', '.join('xyz'[k] for k in order)}")
    if wrong:
        axes = " and ".join("xyz"[k] for k in wrong)
        parts.append(
            f"the sign{'s' if len(wrong) > 1 else ''} of {axes} {'are' if len(wrong) > 1 else 'is'} wrong"
        )
    if unit:
        parts.append(unit)
    return ", and ".join(parts)
