"""Recognition of the columns of a foreign table by joint names, usual words and numbers, or their order."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.tables import TIMESTAMP, UNITS, VECTORS
from flexcal.errors import InputError
from flexcal.importing.columns.assignment import ORIENTATIONS, ColumnAssignment, units_of
from flexcal.importing.columns.base_and_tilts import TILTS, base_columns, tilt_columns
from flexcal.importing.columns.joints import joint_quantities
from flexcal.importing.columns.orientation_names import (
    numbered_quaternion,
    orientation_groups,
    orientation_of,
)
from flexcal.importing.columns.rtde_names import rtde_columns
from flexcal.importing.columns.unit_inference import (
    joint_units,
    point_unit,
    pose_time_unit,
    tilt_unit,
    time_unit,
)
from flexcal.importing.tables import (
    NEUTRAL,
    NO_POINT,
    POINT,
    SIGMA,
    SINGLE,
    TURN,
    ColumnName,
    ForeignTable,
    parse_name,
    rank,
    unknown_unit,
)

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel


_NO_PREFIX = frozenset(["d", "e", "i", "j", "k", "n", "o", "r", "s", "u", "v"])
"""Letters before x, y and z of deviations, directions, turns, uncertainties and velocities."""


@dataclass(frozen=True)
class UnusedColumn:
    """A column that is not imported, and why."""

    column: str
    why: str


@dataclass(frozen=True)
class RecognisedColumns:
    """Recognised columns by quantity, texts such as `target` by their name, and all other columns."""

    placed: Mapping[str, ColumnAssignment]
    texts: Mapping[str, str]
    left_out: tuple[UnusedColumn, ...]


def reasons_unused(unused: Sequence[UnusedColumn]) -> list[str]:
    """Columns that were left out, grouped by reason."""
    by_reason: dict[str, list[str]] = {}
    for left in unused:
        by_reason.setdefault(left.why, []).append(left.column)
    return [f"{', '.join(_shortened(columns))}: {why}" for why, columns in by_reason.items()]


def _shortened(columns: Sequence[str]) -> list[str]:
    """Names that count up, three or more, as the first … the last."""
    parts = [re.match(r"(.*?)(\d+)(\D*)$", column, re.DOTALL) for column in columns]
    listed, at = [], 0
    while at < len(columns):
        end, first = at + 1, parts[at]
        while first and end < len(columns) and (p := parts[end]) and p.group(1, 3) == first.group(1, 3):
            if int(p[2]) != int(first[2]) + end - at:
                break
            end += 1
        if end - at > 2:
            listed.append(f"{columns[at]} … {columns[end - 1]}")
        else:
            listed += columns[at:end]
        at = end
    return listed


def require_known_units(
    guess: RecognisedColumns, recognised: RecognisedColumns, foreign: ForeignTable
) -> None:
    """Raise `InputError` for a unit in the name of a column that is not known, where the `guess` is as `recognised`, without --map."""
    for quantity, item in guess.placed.items():
        known = [unit for unit in units_of(quantity) if unit != TIMESTAMP]
        if item is not recognised.placed.get(quantity) or not known:
            continue
        for column in item.columns:
            unit = unknown_unit(column)
            if unit is not None:
                raise InputError(
                    "E-IMPORT-069",
                    f"{foreign.table.file.path}: the unit [{unit}] of the column '{column}', taken as {quantity}, is none of "
                    f"{', '.join(known)}; convert it to one of them, or say with --map which of them it is, behind the column's name.",
                )


def guess_columns(foreign: ForeignTable, model: RobotModel) -> RecognisedColumns:
    """Recognise the columns of a foreign table; no column is two things, and what could be two is left out and named."""
    if not foreign.named:
        return _by_order(foreign, model)
    names = [parse_name(column, foreign.units.get(column)) for column in foreign.numbers]
    reasons: dict[str, str] = {}
    placed = rtde_columns(foreign, model, reasons)
    rest = _left(names, placed, reasons)
    for quantity, columns in (base_columns(rest) | tilt_columns(rest)).items():
        placed[quantity] = place(foreign, model, quantity, columns, "their names")
    unnamed = numbered_quaternion(_left(names, placed, reasons), foreign)
    others = [name for name in _left(names, placed, reasons) if name.column not in unnamed]
    for quantity, columns in joint_quantities(others, model, reasons).items():
        if quantity in placed:
            reasons |= dict.fromkeys(columns, f"{placed[quantity].columns[0]} … are taken as {quantity}")
        else:
            placed[quantity] = place(foreign, model, quantity, columns, "their names")
    rest = _left(names, placed, reasons)
    turns = orientation_groups(rest) | ({("components", ()): unnamed} if unnamed else {})
    turning = {column for columns in turns.values() for column in columns}
    rest = [name for name in rest if name.column not in turning]
    vectors = _vectors(rest, reasons)
    if "xyz" not in vectors and not any("could both begin xyz" in why for why in reasons.values()):
        vectors |= _prefixed_points(rest, reasons)
    singles = _singles(rest, foreign, reasons)
    turned = orientation_of(turns, rest, vectors.get("xyz", ()), reasons)
    for quantity, columns in (vectors | singles | turned).items():
        other = placed.get(quantity)
        if other is not None and quantity != "xyz":
            reasons |= dict.fromkeys(columns, f"{other.columns[0]} is taken as {quantity}")
        else:
            if other is not None:  # what a controller computes gives way to what was measured
                reasons |= dict.fromkeys(other.columns, f"{columns[0]} … are taken as {quantity}")
            placed[quantity] = place(
                foreign, model, quantity, columns, "their names", points="xyz" in vectors
            )
    if "sigma" in placed and "sigma_xyz" in placed:
        reasons[placed.pop("sigma").columns[0]] = "there are sigma_x, sigma_y and sigma_z"
    texts = {
        name.lower(): name
        for name, values in foreign.texts.items()
        if name.lower() == "station"
        or (
            name.lower() in ("wire", "inclinometer")
            and set(values.tolist()) <= set(model.config.measurements)
        )
        or (name.lower() in ("target", "point") and set(values.tolist()) <= set(model.points))
    }
    for name in foreign.texts.keys() - set(texts.values()):
        if name.lower() == "target":
            reasons[name] = "its names are not all under `points:` of robot.yaml"
    texts = {"target" if key == "point" else key: name for key, name in texts.items()}
    return _guess(foreign, placed, texts, reasons)


def _left(
    names: Sequence[ColumnName], placed: Mapping[str, ColumnAssignment], reasons: Mapping[str, str]
) -> list[ColumnName]:
    """Columns without an assignment so far."""
    taken = {column for assignment in placed.values() for column in assignment.columns}
    return [name for name in names if name.column not in taken and name.column not in reasons]


def _guess(
    foreign: ForeignTable,
    placed: Mapping[str, ColumnAssignment],
    texts: Mapping[str, str],
    reasons: Mapping[str, str],
) -> RecognisedColumns:
    taken = {column for assignment in placed.values() for column in assignment.columns} | set(texts.values())
    left = tuple(
        UnusedColumn(column, reasons.get(column, "not recognised"))
        for column in foreign.table.columns
        if column not in taken
    )
    return RecognisedColumns(placed, texts, left)


def _by_order(foreign: ForeignTable, model: RobotModel) -> RecognisedColumns:
    """Without names: a whole number that counts up or none, the joints, then a point or none."""
    names, n = list(foreign.numbers), model.n
    placed: dict[str, ColumnAssignment] = {}
    rest = names
    if names and (np.diff(foreign.numbers[names[0]]) == 1).all():
        placed["pose"] = place(foreign, model, "pose", (names[0],), "their order")
        rest = names[1:]
    if len(rest) in (n, n + 3):
        placed["q"] = place(foreign, model, "q", tuple(rest[:n]), "their order")
        if len(rest) > n:
            placed["xyz"] = place(foreign, model, "xyz", tuple(rest[n:]), "their order")
    if "q" not in placed:
        placed.clear()
    reasons = dict.fromkeys(names, "the file has no header, and their number is ambiguous")
    return _guess(foreign, placed, {}, reasons)


def _vectors(names: Sequence[ColumnName], reasons: dict[str, str]) -> dict[str, tuple[str, ...]]:
    """Columns of points and their standard deviations."""
    groups: dict[str, dict[tuple[str, ...], dict[str, str]]] = {"xyz": {}, "sigma_xyz": {}}
    for name in names:
        words = set(name.words)
        parts = [POINT[word] for word in name.words if word in POINT]
        rest = tuple(word for word in name.words if word not in POINT)
        rest += () if name.number is None else (str(name.number),)
        if parts and words & SIGMA:
            groups["sigma_xyz"].setdefault(rest, {})[f"sigma_{parts[-1]}"] = name.column
        elif parts and not words & (NO_POINT | TURN | {"q"}):
            groups["xyz"].setdefault(rest, {})[parts[-1]] = name.column
    vectors: dict[str, tuple[str, ...]] = {}
    for quantity, of_it in groups.items():
        wanted = VECTORS[quantity]
        whole = sorted((rest for rest, axes in of_it.items() if set(axes) == set(wanted)), key=rank)
        if len(whole) > 1 and rank(whole[0]) == rank(whole[1]):
            tied = [of_it[rest][wanted[0]] for rest in whole]
            why = f"{' and '.join(tied)} could both begin {quantity}: say which with --map"
            reasons |= {column: why for rest in whole for column in of_it[rest].values()}
        elif whole:
            vectors[quantity] = tuple(of_it[whole[0]][axis] for axis in wanted)
            for rest in whole[1:]:
                reasons |= dict.fromkeys(
                    of_it[rest].values(), f"{vectors[quantity][0]} … are taken as {quantity}"
                )
        else:
            for axes in of_it.values():
                if len(axes) > 1:
                    missing = " and ".join(axis for axis in wanted if axis not in axes)
                    reasons |= dict.fromkeys(axes.values(), f"no {missing} was recognised beside them")
    return vectors


def _prefixed_points(names: Sequence[ColumnName], reasons: dict[str, str]) -> dict[str, tuple[str, ...]]:
    """Columns of points whose names are one word that ends in x, y and z, as Mx, My and Mz, where their unit is one of lengths."""
    groups: dict[tuple[str, ...], dict[str, str]] = {}
    for name in names:
        last = name.words[-1] if name.words else ""
        prefix, axis = last[:-1], last[-1:]
        others = set(name.words[:-1])
        apart = not prefix or prefix in _NO_PREFIX or {prefix, *others} & (NO_POINT | TURN | SIGMA)
        if axis in ("x", "y", "z") and name.unit in UNITS["xyz"] and not apart:
            groups.setdefault((*name.words[:-1], prefix, str(name.number)), {})[axis] = name.column
    whole = [axes for axes in groups.values() if len(axes) == len(VECTORS["xyz"])]
    if len(whole) != 1:
        firsts = [axes["x"] for axes in whole]
        why = f"{' and '.join(firsts)} could both begin xyz: say which with --map"
        reasons |= {column: why for axes in whole for column in axes.values()}
        return {}
    for column in whole[0].values():
        reasons.pop(column, None)
    return {"xyz": tuple(whole[0][axis] for axis in VECTORS["xyz"])}


def _singles(
    names: Sequence[ColumnName], foreign: ForeignTable, reasons: dict[str, str]
) -> dict[str, tuple[str, ...]]:
    """Columns of quantities that have one: all of whose words are of that quantity, or neutral."""
    singles: dict[str, tuple[str, ...]] = {}
    for name in names:
        words = set(name.words)
        for quantity, spoken in SINGLE.items():
            others = words - spoken - NEUTRAL
            if not words & spoken or others or name.number is not None:
                continue
            values = foreign.numbers[name.column]
            if quantity == "pose" and not (values == np.rint(values)).all():
                continue
            if quantity in singles:
                reasons[name.column] = f"{singles[quantity][0]} is taken as {quantity}"
            else:
                singles[quantity] = (name.column,)
    others = [name.column for name in names if name.column in foreign.times and name.column not in reasons]
    if others and "t" not in singles:
        singles["t"] = (others[0],)
    return singles


def place(
    foreign: ForeignTable,
    model: RobotModel,
    quantity: str,
    columns: tuple[str, ...],
    why: str,
    *,
    points: bool = False,
) -> ColumnAssignment:
    """`columns` as a quantity, with the units that the file says, else those that their magnitude or their kind tells.

    With `points` a time is that of a measured pose, else of a sample.
    """
    if quantity == "t" and columns[0] in foreign.times:
        return ColumnAssignment.plain(
            quantity, columns, (TIMESTAMP,), "timestamps, as seconds from the first"
        )
    said = [parse_name(column, foreign.units.get(column)).unit for column in columns]
    known = units_of(quantity)
    if quantity in ORIENTATIONS and not (known and len(set(said)) == 1 and said[0] in known):
        return ColumnAssignment.plain(quantity, columns, (None,) * len(columns), why)
    if all(unit in known for unit in said):
        return ColumnAssignment.plain(quantity, columns, tuple(said), f"{why}; the unit stands there")
    values = np.stack([foreign.numbers[column] for column in columns], axis=1)
    if quantity in ("q", "qa"):
        units = joint_units(model, values)
        return ColumnAssignment.plain(quantity, columns, units, f"{why}; the unit by the joints' limits")
    if quantity in TILTS:
        unit = tilt_unit(
            values[:, 0], [item for item in model.config.measurements.values() if item.kind == "inclinometer"]
        )
        return ColumnAssignment.plain(quantity, columns, (unit,), f"{why}; the unit by their size")
    if quantity in ("xyz", "base_xyz"):
        units = (point_unit(model, values),) * 3
        return ColumnAssignment.plain(quantity, columns, units, f"{why}; the unit by the robot's reach")
    if quantity == "t":
        unit = (pose_time_unit if points else time_unit)(values[:, 0])
        return ColumnAssignment.plain(quantity, columns, (unit,), f"{why}; the unit by the rate")
    default = next(iter(known), None)
    taken = f"; taken to be in {default.replace('degC', '°C')}" if default else ""
    return ColumnAssignment.plain(quantity, columns, (default,) * len(columns), f"{why}{taken}")
