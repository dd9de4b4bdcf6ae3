"""Columns with one entry per joint: by the URDF's joint names, or by words and numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from flexcal.data.tables import JOINT_QUANTITIES
from flexcal.importing.tables import (
    CARTESIAN,
    FORCE,
    JOINT,
    KINDS,
    NEUTRAL,
    NO_JOINT,
    POSITION,
    SIGMA,
    SINGLE,
    SLIDING,
    TURN,
    ColumnName,
    parse_name,
    rank,
)

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_BY_UNIT = {
    "current": ("A", "mA"),
    "tau": ("N m", "N"),
    "dq": ("rad/s", "deg/s", "rpm", "m/s", "mm/s"),
    "ddq": ("rad/s^2", "deg/s^2", "m/s^2", "mm/s^2"),
}
_Groups = dict[tuple[str, tuple[str, ...]], dict[int, str]]
"""Columns by number of joint, of every quantity and wording."""


def joint_quantities(
    names: Sequence[ColumnName], model: RobotModel, reasons: dict[str, str]
) -> dict[str, tuple[str, ...]]:
    """Columns of every quantity with one a joint; `reasons` gets those that are like them and not used."""
    groups: _Groups = {}
    numbered: _Groups = {}
    sliding = [joint.kind == "prismatic" for joint in model.motor_joints]
    for name in names:
        joint, words = _joint_of(name, model)
        slides = any(sliding) if joint is None else sliding[joint]
        quantity = _kind(words, named=joint is not None, unit=name.unit, slides=slides)
        if quantity is None or set(words) & (TURN | SIGMA | SINGLE["temperature"]):
            continue
        if joint is not None:
            groups.setdefault((quantity, words), {})[joint] = name.column
        elif name.number is not None:
            numbered.setdefault((quantity, words), {})[name.number] = name.column
        locked = [
            locked_joint for locked_joint in model.config.locked if _says(name, locked_joint) is not None
        ]
        if joint is None and locked:
            reasons[name.column] = f"{locked[0]} is locked"
    groups = _completed(groups, (set(range(model.n)),))
    ranges = (set(range(model.n)), set(range(1, model.n + 1)))
    for key, columns in _completed(numbered, ranges).items():
        numbers = sorted(columns)
        if numbers in (list(range(model.n)), list(range(1, model.n + 1))):
            groups.setdefault(key, {i - numbers[0]: columns[i] for i in numbers})
        elif key[0] == "q" and len(numbers) > 1:
            why = f"there are {len(numbers)} of them, but {model.n} joints"
            reasons |= {column: why for column in columns.values() if column not in reasons}
    return _best(groups, model.n, reasons)


def _completed(groups: _Groups, wholes: Sequence[set[int]]) -> _Groups:
    """Wordings that complete each other to one of the `wholes`, as the angles of some joints and the strokes of others, are one group."""
    completed = dict(groups)
    for quantity in dict.fromkeys(key[0] for key in groups):
        for standing in range(3):
            parts = [
                key
                for key in groups
                if key[0] == quantity
                and rank(key[1]) == standing
                and not any(set(groups[key]) == w for w in wholes)
            ]
            columns = {number: column for key in parts for number, column in groups[key].items()}
            apart = len(columns) == sum(len(groups[key]) for key in parts)
            if len(parts) > 1 and apart and any(set(columns) == whole for whole in wholes):
                for key in parts:
                    del completed[key]
                completed[parts[0]] = columns
    return completed


def _best(
    groups: Mapping[tuple[str, tuple[str, ...]], Mapping[int, str]], n: int, reasons: dict[str, str]
) -> dict[str, tuple[str, ...]]:
    """Group of every quantity with all joints that is measured rather than commanded; none if two are alike."""
    best: dict[str, tuple[str, ...]] = {}
    for quantity in dict.fromkeys(key[0] for key in groups):
        of_it = {words: columns for (kind, words), columns in groups.items() if kind == quantity}
        order = {words: (rank(words), words != (quantity,)) for words in of_it}
        whole = sorted((words for words in of_it if len(of_it[words]) == n), key=order.__getitem__)
        for words in of_it.keys() - set(whole):
            reasons |= dict.fromkeys(of_it[words].values(), f"only {len(of_it[words])} of {n} joints")
        if quantity == "current":
            why = "currents need a gain in N m/A: --map 'tau1=GAIN*COLUMN[A]' and so on"
            reasons |= {column: why for words in whole for column in of_it[words].values()}
            continue
        if len(whole) > 1 and order[whole[0]] == order[whole[1]]:
            tied = [of_it[words][0] for words in whole if order[words] == order[whole[0]]]
            why = f"{' and '.join(tied)} could both begin {quantity}: say which with --map"
            reasons |= {column: why for words in whole for column in of_it[words].values()}
            continue
        for words in whole[1:]:
            reasons |= dict.fromkeys(of_it[words].values(), f"{of_it[whole[0]][0]} … are taken as {quantity}")
        if whole:
            best[quantity] = tuple(of_it[whole[0]][joint] for joint in range(n))
    return best


def _joint_of(name: ColumnName, model: RobotModel) -> tuple[int | None, tuple[str, ...]]:
    """Joint whose name is part of a column's name, and the other words."""
    best: tuple[int, int, tuple[str, ...]] | None = None
    for joint, called in enumerate(model.motor_names):
        rest = _says(name, called)
        if rest is not None and (best is None or len(called) > best[0]):
            best = (len(called), joint, rest)
    return (None, name.words) if best is None else (best[1], best[2])


def _says(name: ColumnName, called: str) -> tuple[str, ...] | None:
    """The words of a column's name beside a joint's, with or without its last word `joint`; None where it is not in it."""
    column = _run_together(name.text)
    for text in (called, called.removesuffix("_joint")):
        key = _run_together(text)
        at = f"_{column}_".find(f"_{key}_")
        if at >= 0 and len(key) > 1:
            rest = f"_{column}_".replace(f"_{key}_", "_", 1)
            return parse_name(f"q{rest}").words
    return None


def _run_together(text: str) -> str:
    """Letters and digits with single underscores between them."""
    return "_".join("".join(c.lower() if c.isalnum() else " " for c in text).split())


def _kind(words: Sequence[str], *, named: bool, unit: str | None, slides: bool) -> str | None:
    """Quantity denoted by words; with a joint's name and no word it is its position. A joint that slides has a force."""
    telling = [word for word in words if word not in NEUTRAL]
    if not named and set(words) & CARTESIAN:
        return None
    if "_".join(words) in JOINT_QUANTITIES:
        return "_".join(words)
    by_unit = next((quantity for quantity, units in _BY_UNIT.items() if unit in units), None)
    if by_unit is not None and (slides or unit not in SLIDING):
        return by_unit
    if named and slides and set(telling) & FORCE:
        return "tau"
    for quantity, spoken in KINDS:
        if set(telling) & spoken:
            others = {word for word in telling if word not in spoken | POSITION and len(word) > 1}
            sure = named or not others or (set(telling) & JOINT and not others & NO_JOINT)
            return quantity if quantity != "q" or sure else None
    if named and not telling:
        return "q"
    return None
