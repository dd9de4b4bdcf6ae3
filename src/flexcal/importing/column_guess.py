"""What the columns of a foreign table are: by the joints' names, the usual words and numbers, their order where there are no names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.signals import UNITS, VECTORS
from flexcal.importing.column_names import ColumnName, parse_name
from flexcal.importing.foreign_table import ForeignTable
from flexcal.importing.placed_columns import PlacedColumns
from flexcal.importing.unit_guess import point_unit, shared_joint_units, time_unit

if TYPE_CHECKING:
    from flexcal.model import RobotModel

_JOINT = {"q", "j", "joint", "joints", "axis", "axes", "ax", "achse", "theta", "th", "θ", "jnt", "gelenk", "angle", "angles", "winkel"}
"""Words of joint positions, whatever stands beside them; those of `_POSITION` are only with others of these, or a joint's name."""
_POSITION = _JOINT | {"a", "position", "positions", "pos", "state", "states", "value", "values", "encoder"}
_NO_JOINT = {"tcp", "cartesian", "pose", "error", "err", "dev", "deviation", "force", "voltage", "limit", "mode", "offset", "digital"}
_NO_JOINT |= {"analog", "residual", "correction", "delta", "status"}
_KINDS = (
    ("ddq", {"ddq", "qdd", "acceleration", "accelerations", "acc", "accel"}),
    ("dq", {"dq", "qd", "velocity", "velocities", "vel", "speed", "qdot", "rate"}),
    ("tau", {"tau", "τ", "torque", "torques", "effort", "efforts", "moment", "drehmoment"}),
    ("current", {"current", "currents", "i", "iq", "strom", "amp", "amps"}),
    ("q", _POSITION),
)  # fmt: skip
_MEASURED = {"actual", "act", "ist", "measured", "meas", "measurement", "feedback", "fb", "tracker", "lt", "smr"}
_COMMANDED = {"target", "desired", "des", "soll", "cmd", "command", "commanded", "ref", "reference", "nominal", "nom", "setpoint"}  # fmt: skip
_NEUTRAL = _MEASURED | _COMMANDED | {"robot", "arm", "motor", "link", "the", "of", "in"}
_POINT = {"x", "y", "z"}
_FUSED = {"px": "x", "py": "y", "pz": "z"}
_NO_POINT = {"force", "f", "error", "err", "deviation", "dev", "delta", "normal", "velocity", "vel", "v", "speed", "acc", "offset", "rpy"}  # fmt: skip
_TURN = {"orientation", "quaternion", "quat", "rotation", "rot"}
_SIGMA = {"sigma", "σ", "std", "sd", "uncertainty", "stddev"}
_SINGLE = {
    "t": {"t", "time", "timestamp", "stamp", "zeit", "seconds", "secs"},
    "pose": {"pose", "poses", "no", "nr", "id", "number", "index", "idx", "measurement", "point", "punkt", "sample", "row"},
    "payload": {"payload", "load"},
    "temperature": {"temperature", "temp", "temperatur"},
    "length": {"length", "wire", "distance"},
}  # fmt: skip


@dataclass(frozen=True)
class LeftOut:
    """A column that is not imported, and why."""

    column: str
    why: str


@dataclass(frozen=True)
class Guess:
    """What was recognised, by quantity, texts such as `target` by their name, and all other columns."""

    placed: Mapping[str, PlacedColumns]
    texts: Mapping[str, str]
    left_out: tuple[LeftOut, ...]


def reasons_of(left_out: Sequence[LeftOut]) -> list[str]:
    """What was left out and why, columns with the same reason together."""
    by_reason: dict[str, list[str]] = {}
    for left in left_out:
        by_reason.setdefault(left.why, []).append(left.column)
    return [f"{', '.join(columns)}: {why}" for why, columns in by_reason.items()]


def guess_columns(foreign: ForeignTable, model: RobotModel) -> Guess:
    """Recognise the columns of a foreign table; nothing is recognised twice, and what could be two things is left out and named."""
    if not foreign.named:
        return _by_order(foreign, model)
    names = [parse_name(column, foreign.units.get(column)) for column in foreign.numbers]
    reasons: dict[str, str] = {}
    placed: dict[str, PlacedColumns] = {}
    for quantity, columns in _joint_quantities(names, model, reasons).items():
        placed[quantity] = place(foreign, model, quantity, columns, "their names")
    taken = {column for found in placed.values() for column in found.columns}
    rest = [name for name in names if name.column not in taken and name.column not in reasons]
    for quantity, columns in (_vectors(rest, reasons) | _singles(rest, foreign, reasons)).items():
        placed[quantity] = place(foreign, model, quantity, columns, "their names")
    if "sigma" in placed and "sigma_xyz" in placed:
        reasons[placed.pop("sigma").columns[0]] = "there are sigma_x, sigma_y and sigma_z"
    texts = {
        name.lower(): name
        for name, values in foreign.texts.items()
        if name.lower() == "station"
        or (name.lower() in ("target", "point") and set(values.tolist()) <= set(model.points))
    }
    texts = {"target" if key == "point" else key: name for key, name in texts.items()}
    return _guess(foreign, placed, texts, reasons)


def _guess(
    foreign: ForeignTable,
    placed: Mapping[str, PlacedColumns],
    texts: Mapping[str, str],
    reasons: Mapping[str, str],
) -> Guess:
    taken = {column for found in placed.values() for column in found.columns} | set(texts.values())
    left = tuple(
        LeftOut(column, reasons.get(column, "not recognised"))
        for column in foreign.table.columns
        if column not in taken
    )
    return Guess(placed, texts, left)


def _by_order(foreign: ForeignTable, model: RobotModel) -> Guess:
    """Without names: a whole number that counts up or none, the joints, then a point or none."""
    names, n = list(foreign.numbers), model.n
    placed: dict[str, PlacedColumns] = {}
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
    reasons = dict.fromkeys(names, "the file has no header, and their number does not tell")
    return _guess(foreign, placed, {}, reasons)


def _joint_quantities(
    names: Sequence[ColumnName], model: RobotModel, reasons: dict[str, str]
) -> dict[str, tuple[str, ...]]:
    """Columns of every quantity with one a joint; `reasons` gets those that are like them and not used."""
    groups: dict[tuple[str, tuple[str, ...]], dict[int, str]] = {}
    numbered: dict[tuple[str, tuple[str, ...]], dict[int, str]] = {}
    for name in names:
        joint, words = _joint_of(name, model)
        quantity = _kind(words, named=joint is not None, unit=name.unit)
        if quantity is None or set(words) & (_TURN | _SIGMA | _SINGLE["temperature"]):
            continue
        if joint is not None:
            groups.setdefault((quantity, words), {})[joint] = name.column
        elif name.number is not None:
            numbered.setdefault((quantity, words), {})[name.number] = name.column
        locked = [held for held in model.config.locked if _says(name, held) is not None]
        if joint is None and locked:
            reasons[name.column] = f"{locked[0]} is locked"
    for key, columns in numbered.items():
        numbers = sorted(columns)
        if numbers in (list(range(model.n)), list(range(1, model.n + 1))):
            groups.setdefault(key, {i - numbers[0]: columns[i] for i in numbers})
        elif key[0] == "q" and len(numbers) > 1:
            why = f"there are {len(numbers)} of them, but {model.n} joints"
            reasons |= {column: why for column in columns.values() if column not in reasons}
    return _best(groups, model.n, reasons)


def _best(
    groups: Mapping[tuple[str, tuple[str, ...]], Mapping[int, str]], n: int, reasons: dict[str, str]
) -> dict[str, tuple[str, ...]]:
    """Of every quantity the group with all joints that is measured rather than commanded; none where two are alike."""
    found: dict[str, tuple[str, ...]] = {}
    for quantity in dict.fromkeys(key[0] for key in groups):
        of_it = {words: columns for (kind, words), columns in groups.items() if kind == quantity}
        whole = sorted((words for words in of_it if len(of_it[words]) == n), key=_rank)
        for words in of_it.keys() - set(whole):
            reasons |= dict.fromkeys(of_it[words].values(), f"only {len(of_it[words])} of {n} joints")
        if quantity == "current":
            why = "currents need a gain in N m/A: --map 'tau1=GAIN*COLUMN[A]' and so on"
            reasons |= {column: why for words in whole for column in of_it[words].values()}
            continue
        if len(whole) > 1 and _rank(whole[0]) == _rank(whole[1]):
            tied = [of_it[words][0] for words in whole if _rank(words) == _rank(whole[0])]
            why = f"{' and '.join(tied)} begin what could both be {quantity}: say which with --map"
            reasons |= {column: why for words in whole for column in of_it[words].values()}
            continue
        for words in whole[1:]:
            reasons |= dict.fromkeys(of_it[words].values(), f"{of_it[whole[0]][0]} … are taken as {quantity}")
        if whole:
            found[quantity] = tuple(of_it[whole[0]][joint] for joint in range(n))
    return found


def _rank(words: Sequence[str]) -> int:
    if set(words) & _MEASURED:
        return 0
    return 2 if set(words) & _COMMANDED else 1


def _joint_of(name: ColumnName, model: RobotModel) -> tuple[int | None, tuple[str, ...]]:
    """The joint whose name stands in that of a column, and the other words."""
    best: tuple[int, int, tuple[str, ...]] | None = None
    for joint, called in enumerate(model.joint_names):
        rest = _says(name, called)
        if rest is not None and (best is None or len(called) > best[0]):
            best = (len(called), joint, rest)
    return (None, name.words) if best is None else (best[1], best[2])


def _says(name: ColumnName, called: str) -> tuple[str, ...] | None:
    """The words of a column's name beside a joint's, with or without its last word `joint`; None where it is not in it."""
    column = _run_together(name.column)
    for text in (called, called.removesuffix("_joint")):
        key = _run_together(text)
        at = f"_{column}_".find(f"_{key}_")
        if at >= 0 and len(key) > 1:
            rest = f"_{column}_".replace(f"_{key}_", "_", 1)
            return parse_name(rest.strip("_") or "q").words
    return None


def _run_together(text: str) -> str:
    """Letters and digits with single underscores between them."""
    return "_".join("".join(c.lower() if c.isalnum() else " " for c in text).split())


def _kind(words: Sequence[str], *, named: bool, unit: str | None) -> str | None:
    """The quantity that words speak of; with a joint's name and no word it is its position."""
    telling = [word for word in words if word not in _NEUTRAL]
    if unit in ("A", "mA"):
        return "current"
    for quantity, spoken in _KINDS:
        if set(telling) & spoken:
            others = {word for word in telling if word not in spoken | _POSITION and len(word) > 1}
            sure = named or not others or (set(telling) & _JOINT and not others & _NO_JOINT)
            return quantity if quantity != "q" or sure else None
    if named and not telling:
        return "q"
    return None


def _vectors(names: Sequence[ColumnName], reasons: dict[str, str]) -> dict[str, tuple[str, ...]]:
    """Columns of points, their standard deviations and quaternions."""
    groups: dict[str, dict[tuple[str, ...], dict[str, str]]] = {"xyz": {}, "sigma_xyz": {}, "quaternion": {}}
    for name in names:
        words = set(name.words)
        parts = [_FUSED.get(word, word) for word in name.words if word in _POINT | _FUSED.keys() | {"w"}]
        fused = [word for word in name.words if word in VECTORS["quaternion"]]
        rest = tuple(w for w in name.words if w not in parts and w not in fused and w not in _FUSED)
        rest += () if name.number is None else (str(name.number),)
        if fused or (words & (_TURN | {"q"}) and parts):
            axis = fused[0] if fused else f"q{parts[-1]}"
            groups["quaternion"].setdefault(rest, {})[axis] = name.column
        elif parts and parts[-1] != "w" and words & _SIGMA:
            groups["sigma_xyz"].setdefault(rest, {})[f"sigma_{parts[-1]}"] = name.column
        elif parts and parts[-1] != "w" and not words & _NO_POINT:
            groups["xyz"].setdefault(rest, {})[parts[-1]] = name.column
    found: dict[str, tuple[str, ...]] = {}
    for quantity, of_it in groups.items():
        wanted = VECTORS[quantity]
        whole = sorted((rest for rest, axes in of_it.items() if set(axes) == set(wanted)), key=_rank)
        if len(whole) > 1 and _rank(whole[0]) == _rank(whole[1]):
            tied = [of_it[rest][wanted[0]] for rest in whole]
            why = f"{' and '.join(tied)} begin what could both be {quantity}: say which with --map"
            reasons |= {column: why for rest in whole for column in of_it[rest].values()}
        elif whole:
            found[quantity] = tuple(of_it[whole[0]][axis] for axis in wanted)
            for rest in whole[1:]:
                reasons |= dict.fromkeys(of_it[rest].values(), f"{found[quantity][0]} … are taken as {quantity}")
    return found


def _singles(
    names: Sequence[ColumnName], foreign: ForeignTable, reasons: dict[str, str]
) -> dict[str, tuple[str, ...]]:
    """Columns of quantities that have one: all of whose words are of that quantity, or neutral."""
    found: dict[str, tuple[str, ...]] = {}
    for name in names:
        words = set(name.words)
        for quantity, spoken in (*_SINGLE.items(), ("sigma", _SIGMA)):
            others = words - spoken - _NEUTRAL
            if not words & spoken or others or name.number is not None:
                continue
            values = foreign.numbers[name.column]
            if quantity == "pose" and not (values == np.rint(values)).all():
                continue
            if quantity in found:
                reasons[name.column] = f"{found[quantity][0]} is taken as {quantity}"
            else:
                found[quantity] = (name.column,)
    return found


def place(
    foreign: ForeignTable, model: RobotModel, quantity: str, columns: tuple[str, ...], why: str
) -> PlacedColumns:
    """`columns` as a quantity, with the units that the file says, else those that their magnitude or their kind tells."""
    said = [parse_name(column, foreign.units.get(column)).unit for column in columns]
    known = UNITS.get(quantity, {})
    if all(unit in known for unit in said):
        return PlacedColumns.plain(quantity, columns, tuple(said), f"{why}; the unit stands there")
    values = np.stack([foreign.numbers[column] for column in columns], axis=1)
    if quantity in ("q", "qa"):
        units = shared_joint_units(model, values)
        return PlacedColumns.plain(quantity, columns, units, f"{why}; the unit by the joints' limits")
    if quantity == "xyz":
        units = (point_unit(model, values),) * 3
        return PlacedColumns.plain(quantity, columns, units, f"{why}; the unit by the robot's reach")
    if quantity == "t":
        return PlacedColumns.plain(quantity, columns, (time_unit(values[:, 0]),), f"{why}; the unit by the rate")
    default = next(iter(known), None)
    taken = f"; taken to be in {default}" if default else ""
    return PlacedColumns.plain(quantity, columns, (default,) * len(columns), f"{why}{taken}")
