"""Columns of measured orientations, by their names: three angles or a rotation vector, or the four components of a quaternion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.data.tables import VECTORS
from flexcal.importing.tables import NO_POINT, POINT, SIGMA, TURN, ColumnName, ForeignTable, rank

_BY_AXIS = (
    ("rx", "ry", "rz"),
    ("rotx", "roty", "rotz"),
    ("rvx", "rvy", "rvz"),
    ("ex", "ey", "ez"),
    ("roll", "pitch", "yaw"),
    ("w", "p", "r"),
    ("omega", "phi", "kappa"),
    ("ω", "φ", "κ"),
)
_IN_ORDER = (
    ("a", "b", "c"),
    ("o", "a", "t"),
    ("phi", "theta", "psi"),
    ("φ", "θ", "ψ"),
    ("alpha", "beta", "gamma"),
    ("α", "β", "γ"),
)
_BY_AXIS_NUMBERED = {"rotvec", "rv", "vec", "vector", "rpy"}
_NUMBERED = TURN | _BY_AXIS_NUMBERED | {"euler"}
_ABOUT = _NUMBERED | {"angle", "ang", "theta", "θ", "winkel", "r"}
"""Words with which x, y and z are axes to turn about."""
_OTHERS = (NO_POINT - {"rpy"}) | SIGMA
"""Words of what is no orientation: its errors, its speed."""
_CONSTANT_NORM = 1e-3
"""Largest relative scatter of the norm of quaternions; four joint positions scatter more."""
Place = tuple[str, ...]
"""Words and number that columns have beside their axis."""


def orientation_groups(names: Sequence[ColumnName]) -> dict[tuple[str, Place], tuple[str, ...]]:
    """Columns of every whole orientation, by quantity (`quaternion`, `rxyz`, `angles`, `components`) and place."""
    names = [name for name in names if not set(name.words) & _OTHERS]
    groups: dict[tuple[str, Place], tuple[str, ...]] = {}
    taken: set[str] = set()
    for found in (_quaternions(names), _spelled(names), _about_axes(names), _numbered(names)):
        for key, columns in found.items():
            if not taken & set(columns) and key not in groups:
                groups[key] = columns
                taken |= set(columns)
    return groups


def orientation_of(
    groups: Mapping[tuple[str, Place], tuple[str, ...]],
    names: Sequence[ColumnName],
    points: Sequence[str],
    reasons: dict[str, str],
) -> dict[str, tuple[str, ...]]:
    """Orientation that belongs to the columns of measured `points`, by its quantity: of the same words, else the best measured one.

    `names` are those of all columns that may be points. One that belongs to other points is none; `reasons` gets those that are not used.
    """
    places = {name.column: _point_place(name) for name in names if set(name.words) & POINT.keys()}
    own = places.get(points[0]) if points else None
    of_others = {place for column, place in places.items() if column not in points} - {own}
    usable: dict[tuple[str, Place], tuple[str, ...]] = {}
    for (quantity, place), columns in groups.items():
        if own is not None and place in of_others:
            reasons |= dict.fromkeys(columns, f"of other points than {points[0]} …")
        else:
            usable[quantity, place] = columns
    order = sorted(usable, key=lambda key: (key[1] != own, rank(key[1])))
    if (
        len(order) > 1
        and (order[0][1] == own) == (order[1][1] == own)
        and rank(order[0][1]) == rank(order[1][1])
    ):
        why = f"{' and '.join(usable[key][0] for key in order[:2])} could both begin the orientation: say which with --map"
        reasons |= {column: why for columns in usable.values() for column in columns}
        return {}
    for key in order[1:]:
        reasons |= dict.fromkeys(usable[key], f"{usable[order[0]][0]} … are taken as the orientation")
    return {order[0][0]: usable[order[0]]} if order else {}


def _place(words: Sequence[str], number: int | None) -> Place:
    """What distinguishes one orientation or point from another: words other than of turning and place, and the number."""
    telling = [word for word in words if word not in (_ABOUT | {"position", "point", "pose", "pos"})]
    return (*telling, *(() if number is None else (str(number),)))


def _point_place(name: ColumnName) -> Place:
    return _place([word for word in name.words if word not in POINT], name.number)


def _quaternions(names: Sequence[ColumnName]) -> dict[tuple[str, Place], tuple[str, ...]]:
    """Quaternions whose components are named: qw, quat_w, orientation.w."""
    wanted = VECTORS["quaternion"]
    found: dict[Place, dict[str, str]] = {}
    for name in names:
        parts = [POINT.get(word, word) for word in name.words if word in POINT or word == "w"]
        fused = [word for word in name.words if word in wanted]
        if fused or (set(name.words) & (TURN | {"q"}) and parts):
            rest = [word for word in name.words if word not in (*POINT, "w", "q", *wanted)]
            found.setdefault(_place(rest, name.number), {})[fused[0] if fused else f"q{parts[-1]}"] = (
                name.column
            )
    return {
        ("quaternion", place): tuple(axes[axis] for axis in wanted)
        for place, axes in found.items()
        if set(axes) == set(wanted)
    }


def _spelled(names: Sequence[ColumnName]) -> dict[tuple[str, Place], tuple[str, ...]]:
    """Triples of words such as rx, ry, rz or roll, pitch, yaw."""
    found: dict[tuple[str, Place], tuple[str, ...]] = {}
    for quantity, triples in (("rxyz", _BY_AXIS), ("angles", _IN_ORDER)):
        for triple in triples:
            groups: dict[Place, dict[str, str]] = {}
            for name in names:
                said = [word for word in name.words if word in triple]
                if said:
                    rest = [word for word in name.words if word != said[-1]]
                    groups.setdefault(_place(rest, name.number), {})[said[-1]] = name.column
            for place, axes in groups.items():
                if len(axes) == 3:
                    found.setdefault((quantity, place), tuple(axes[word] for word in triple))
    return found


def _about_axes(names: Sequence[ColumnName]) -> dict[tuple[str, Place], tuple[str, ...]]:
    """Triples such as rot_x, rot_y, rot_z; of r_x, r_y, r_z only where other columns are points."""
    points = any(set(name.words) & POINT.keys() and not set(name.words) & _ABOUT for name in names)
    groups: dict[Place, dict[str, str]] = {}
    for name in names:
        axes = [POINT[word] for word in name.words if word in POINT]
        about = set(name.words) & _ABOUT
        if axes and about and (points or about != {"r"}):
            rest = [word for word in name.words if word not in POINT]
            groups.setdefault(_place(rest, name.number), {})[axes[-1]] = name.column
    return {
        ("rxyz", place): (axes["x"], axes["y"], axes["z"])
        for place, axes in groups.items()
        if set(axes) == set("xyz")
    }


def _numbered(names: Sequence[ColumnName]) -> dict[tuple[str, Place], tuple[str, ...]]:
    """Numbered columns: three angles such as euler[0], or four components such as quat1."""
    groups: dict[Place, dict[int, str]] = {}
    for name in names:
        if name.number is not None and set(name.words) & _NUMBERED:
            groups.setdefault(name.words, {})[name.number] = name.column
    found: dict[tuple[str, Place], tuple[str, ...]] = {}
    for words, numbered in groups.items():
        columns = _counted(numbered)
        place = _place(words, None)
        if len(columns) == 3:
            found["rxyz" if set(words) & _BY_AXIS_NUMBERED else "angles", place] = columns
        elif len(columns) == 4:
            found["components", place] = columns
    return found


def numbered_quaternion(names: Sequence[ColumnName], foreign: ForeignTable) -> tuple[str, ...]:
    """The columns q1 … q4 or q0 … q3 where they are quaternions rather than joint positions: of constant norm; else none."""
    columns = _counted(
        {name.number: name.column for name in names if name.words == ("q",) and name.number is not None}
    )
    return columns if len(columns) == 4 and _norm_is_constant(foreign, columns) else ()


def _counted(numbered: Mapping[int, str]) -> tuple[str, ...]:
    """Columns in the order of their numbers, which count up from 0 or 1; else none."""
    numbers = sorted(numbered)
    whole = numbers in (list(range(len(numbers))), list(range(1, len(numbers) + 1)))
    return tuple(numbered[number] for number in numbers) if whole else ()


def _norm_is_constant(foreign: ForeignTable, columns: Sequence[str]) -> bool:
    values = np.stack([foreign.numbers[column] for column in columns], axis=1)
    norm = np.linalg.norm(values, axis=1)
    return bool(np.ptp(values, axis=0).max(initial=0.0) > 0 and np.ptp(norm) <= _CONSTANT_NORM * norm.mean())
