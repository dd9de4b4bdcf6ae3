"""Columns of a record of an excited axis: input, output, and the reference of its controller."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from flexcal.errors import InputError
from flexcal.files.structuring import suggestion
from flexcal.frequency.arbitrary import Channel
from flexcal.importing.tables import COMMANDED, KINDS, SINGLE, ColumnName, ForeignTable, parse_name, rank

KIND_NAMES = {"position": 0, "velocity": 1, "acceleration": 2}
_FORCE = frozenset(["force", "kraft", "thrust"])
_DRIVE = frozenset(["u", "input", "excitation"])
_ADDED = frozenset(
    ["excitation", "injection", "injected", "dither", "perturbation", "multisine", "chirp", "sweep", "prbs"]
)
"""Words of a signal that is added somewhere in a loop. A commanded position is one too; commanded velocities and torques are fed back."""
_NO_OUTPUT = frozenset(["error", "err", "following", "deviation", "temperature", "temp", "voltage", "status"])
_SI: dict[str, tuple[float, str, int]] = {
    "rad": (1.0, "rad", 0),
    "deg": (pi / 180, "rad", 0),
    "turn": (2 * pi, "rad", 0),
    "m": (1.0, "m", 0),
    "mm": (1e-3, "m", 0),
    "um": (1e-6, "m", 0),
    "rad/s": (1.0, "rad", 1),
    "deg/s": (pi / 180, "rad", 1),
    "rpm": (pi / 30, "rad", 1),
    "m/s": (1.0, "m", 1),
    "mm/s": (1e-3, "m", 1),
    "rad/s^2": (1.0, "rad", 2),
    "deg/s^2": (pi / 180, "rad", 2),
    "m/s^2": (1.0, "m", 2),
    "mm/s^2": (1e-3, "m", 2),
    "g": (9.80665, "m", 2),
}
"""Factor to SI, the unit of the position that belongs to it, and the derivative, by unit of an output."""
_SPELLED = {
    "m/s²": "m/s^2",
    "m/s2": "m/s^2",
    "mm/s²": "mm/s^2",
    "mm/s2": "mm/s^2",
    "g": "g",
    "m/s^2": "m/s^2",
}
_SI_INPUT = {"N m": (1.0, "N m"), "N": (1.0, "N"), "A": (1.0, "A"), "mA": (1e-3, "A"), "V": (1.0, "V")}
_OWN = {"tau": (1.0, "N m", 0), "q": (1.0, "rad", 0), "dq": (1.0, "rad", 1), "ddq": (1.0, "rad", 2)}
"""Columns of flexcal's own joint logs, as tau1 and q1, in SI units."""
_QUIET = 0.1
"""Standard deviation, relative to the largest input's, below which an input is not taken as one."""


@dataclass(frozen=True)
class ResponseColumn:
    """A column with its channel; values · `factor` have the channel's unit (and its time derivatives)."""

    channel: Channel
    factor: float = 1.0

    def values(self, foreign: ForeignTable) -> np.ndarray:
        """(N,)"""
        return self.factor * foreign.numbers[self.channel.name]


@dataclass(frozen=True)
class ResponseColumns:
    """Time (None where rows are counted), inputs, outputs and references of a file, and why they were taken, a sentence each.

    `guessed` tells that the references were recognised, not named.
    """

    time: str | None
    inputs: tuple[ResponseColumn, ...]
    outputs: tuple[ResponseColumn, ...]
    references: tuple[ResponseColumn, ...]
    remarks: tuple[str, ...]
    guessed: bool = False


def response_columns(
    foreign: ForeignTable,
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    references: Sequence[str] = (),
) -> ResponseColumns:
    """The columns that were named, as COLUMN, COLUMN[unit] or COLUMN=velocity, else recognised by their words and units.

    Raises `InputError` where a named column is not there, and where what drives or what moves cannot be recognised.
    """
    names = {column: _parsed(column, foreign) for column in foreign.numbers}
    time = _time(foreign, names)
    taken = {time} if time else set()
    remarks = []
    chosen_inputs = [_named(text, foreign, "--input", is_output=False) for text in inputs]
    chosen_references = [_named(text, foreign, "--reference", is_output=False) for text in references]
    chosen_outputs = [_named(text, foreign, "--output", is_output=True) for text in outputs]
    taken |= {c.channel.name for c in (*chosen_inputs, *chosen_references, *chosen_outputs)}
    free = {column: name for column, name in names.items() if column not in taken}
    if not chosen_inputs:
        chosen_inputs = _guessed_inputs(foreign, free)
        free = {
            column: name
            for column, name in free.items()
            if column not in {c.channel.name for c in chosen_inputs}
        }
    if not chosen_outputs:
        chosen_outputs = _guessed_outputs(foreign, free)
        free = {
            column: name
            for column, name in free.items()
            if column not in {c.channel.name for c in chosen_outputs}
        }
    if not chosen_inputs or not chosen_outputs:
        lacking = "what moves (a position, velocity or acceleration)"
        if not chosen_inputs:
            lacking = "what drives the axis (a torque, force or current)"
        option = "--input COLUMN" if not chosen_inputs else "--output COLUMN=position"
        listed = ", ".join(column for column in foreign.numbers if column != time)
        raise InputError(
            "E-IMPORT-001",
            f"{foreign.table.file.path}: no column was recognised as {lacking}; say which with {option}; there are {listed}.",
        )
    guessed = [] if chosen_references else _guessed_references(foreign, free, len(chosen_inputs))
    free = {column: name for column, name in free.items() if column not in {c.channel.name for c in guessed}}
    if free:
        remarks.append(
            f"left out: {', '.join(free)} (name them with --input or --output where they belong to the experiment)"
        )
    return ResponseColumns(
        time,
        tuple(chosen_inputs),
        tuple(chosen_outputs),
        (*chosen_references, *guessed),
        tuple(remarks),
        bool(guessed),
    )


def _parsed(column: str, foreign: ForeignTable) -> ColumnName:
    return parse_name(re.sub(r"[#$\\{}]", "", column), foreign.units.get(column))


def _time(foreign: ForeignTable, names: Mapping[str, ColumnName]) -> str | None:
    if foreign.times:
        return foreign.times[0]
    for column, name in names.items():
        if name.words and set(name.words) <= SINGLE["t"] | {"rel", "relative", "elapsed", "ros"}:
            return column
    if not foreign.named and names:
        first = next(iter(names))
        if (np.diff(foreign.numbers[first]) > 0).all():
            return first
    return None


def _named(text: str, foreign: ForeignTable, option: str, *, is_output: bool) -> ResponseColumn:
    column, kind, unit = text, None, None
    if column not in foreign.numbers and "=" in column:
        column, _, kind = column.rpartition("=")
        if kind not in KIND_NAMES:
            raise InputError(
                "E-IMPORT-002",
                f"{option} {text}: '{kind}' is none of {', '.join(KIND_NAMES)}{suggestion(kind, list(KIND_NAMES)) or '.'}",
            )
    if column not in foreign.numbers and column.endswith("]") and "[" in column:
        column, _, unit = column[:-1].rpartition("[")
    plain = {re.sub(r"[#$\\{}]", "", name): name for name in foreign.numbers}
    column = plain.get(column, column)
    if column not in foreign.numbers:
        near = suggestion(column, list(foreign.numbers)) or f"; there are {', '.join(foreign.numbers)}."
        raise InputError(
            "E-IMPORT-003",
            f"{option} {text}: {foreign.table.file.path} has no column of numbers '{column}'{near}",
        )
    name = _parsed(column, foreign)
    if not is_output:
        factor, said = _input_unit(unit or name.unit or _own_unit(column))
        return ResponseColumn(Channel(column, said), factor)
    recognised = _output(column, name, unit)
    if kind is not None:
        if (
            recognised is not None
            and recognised.channel.unit
            and recognised.channel.derivative != KIND_NAMES[kind]
        ):
            raise InputError(
                "E-IMPORT-004",
                f"{option} {text}: the unit of '{column}' is not that of a {kind}; leave one of them out.",
            )
        factor, said = (recognised.factor, recognised.channel.unit) if recognised is not None else (1.0, "")
        return ResponseColumn(Channel(column, said, KIND_NAMES[kind]), factor)
    if recognised is None:
        raise InputError(
            "E-IMPORT-005",
            f"{option} {text}: whether '{column}' is a position, a velocity or an acceleration is not known; "
            f"say it, as in {option} '{column}=acceleration'.",
        )
    return recognised


def _input_unit(unit: str | None) -> tuple[float, str]:
    return _SI_INPUT.get(unit or "", (1.0, unit or ""))


def _output(column: str, name: ColumnName, said: str | None = None) -> ResponseColumn | None:
    """A column by its unit, else by its words; None where neither tells."""
    unit = said or name.unit
    unit = _SPELLED.get(unit or "", unit)
    words = set(name.words)
    by_words = next(
        (
            order
            for kind, order in (("ddq", 2), ("dq", 1), ("q", 0))
            for k, w in KINDS
            if k == kind and words & (w - {"a"})
        ),
        None,
    )
    bracket = re.search(r"[\[(]\s*([^\])]*?)\s*[\])]\s*$", column)
    if unit is None and bracket:
        unit = _SPELLED.get(bracket[1].strip().lower())
    if unit in _SI:
        factor, si, order = _SI[unit]
        if unit == "g" and by_words != 2:
            return None
        if unit in ("m", "mm") and by_words == 2:
            return None
        return ResponseColumn(Channel(column, si, order), factor)
    own = _OWN.get(column.rstrip("0123456789")) if column[-1:].isdigit() and by_words is not None else None
    if own is not None and unit is None:
        return ResponseColumn(Channel(column, own[1], own[2]), own[0])
    return None if by_words is None else ResponseColumn(Channel(column, "", by_words))


def _own_unit(column: str) -> str | None:
    """Unit of the torque column of flexcal's own joint log, as tau1."""
    return "N m" if column.rstrip("0123456789") == "tau" and column[-1:].isdigit() else None


def _spread(foreign: ForeignTable, column: str) -> float:
    """Standard deviation of a column, infinite or NaN where its numbers are too large for one."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.nanstd(foreign.numbers[column]))


def _guessed_inputs(foreign: ForeignTable, free: Mapping[str, ColumnName]) -> list[ResponseColumn]:
    """All columns of the most telling kind there is, measured ones before commanded ones, without those that hardly change."""
    kinds = [dict(KINDS)["tau"], _FORCE, dict(KINDS)["current"], _DRIVE]
    for words in kinds:
        candidates = [
            c for c, name in free.items() if set(name.words) & words and not set(name.words) & _NO_OUTPUT
        ]
        if not candidates:
            continue
        best = min(rank(free[column].words) for column in candidates)
        candidates = [column for column in candidates if rank(free[column].words) == best]
        spread = {column: _spread(foreign, column) for column in candidates}
        largest = max(spread.values())
        columns = [column for column in candidates if largest > 0 and spread[column] > _QUIET * largest]
        result = []
        for column in columns:
            factor, unit = _input_unit(free[column].unit or _own_unit(column))
            result.append(ResponseColumn(Channel(column, unit), factor))
        return result
    return []


def _guessed_references(
    foreign: ForeignTable, free: Mapping[str, ColumnName], inputs: int
) -> list[ResponseColumn]:
    """Signals that were added in a loop, else commanded positions, that move; none unless there is one for every input."""
    moving = {column: name for column, name in free.items() if _spread(foreign, column) > 0}
    added = [column for column, name in moving.items() if set(name.words) & _ADDED]
    commanded = [
        column
        for column, name in moving.items()
        if set(name.words) & COMMANDED
        and not set(name.words) & (_NO_OUTPUT | _FORCE | dict(KINDS)["tau"] | dict(KINDS)["current"])
        and (item := _output(column, name)) is not None
        and item.channel.derivative == 0
    ]
    for references in (added, commanded):
        if len(references) == inputs:
            return [ResponseColumn(Channel(column)) for column in references]
    return []


def _guessed_outputs(foreign: ForeignTable, free: Mapping[str, ColumnName]) -> list[ResponseColumn]:
    """All columns of the lowest derivative there is, measured ones before commanded ones."""
    candidates = [
        (column, item)
        for column, name in free.items()
        if not set(name.words) & _NO_OUTPUT
        and not set(name.words) & (dict(KINDS)["tau"] | dict(KINDS)["current"] | _FORCE)
        and (item := _output(column, name)) is not None
        and _spread(foreign, column) > 0
    ]
    if not candidates:
        return []
    lowest = min(item.channel.derivative for _, item in candidates)
    candidates = [(column, item) for column, item in candidates if item.channel.derivative == lowest]
    best = min(rank(free[column].words) for column, _ in candidates)
    return [item for column, item in candidates if rank(free[column].words) == best]
