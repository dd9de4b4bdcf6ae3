"""The option `--map q1=-J1[deg]+90 x=X[mm]`, which overrides recognised columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from flexcal.data.tables import UNITS
from flexcal.errors import InputError
from flexcal.files.structuring import suggestion
from flexcal.importing.columns.assignment import (
    NUMBERED,
    ORIENTATIONS,
    ColumnAssignment,
    assigned_names,
    units_of,
)
from flexcal.importing.columns.recognition import RecognisedColumns, UnusedColumn, place
from flexcal.importing.tables import ForeignTable, parse_name, unit_of

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_TEXTS = ("target", "station")
_FACTOR = re.compile(r"^([-+]?)(?:(\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)\s*\*)?\s*(.*)$")
_OFFSET = re.compile(r"^(.*?)\s*([-+]\s*\d+(?:\.\d*)?)$")
_UNIT = re.compile(r"^(.*?)\s*\[([^\]]*)\]$")


def apply_map(
    given: Sequence[str], guess: RecognisedColumns, foreign: ForeignTable, model: RobotModel
) -> RecognisedColumns:
    """Recognised columns with those of --map in their place.

    Each entry is NAME=COLUMN, where NAME is flexcal's (q1, x, t, tau1, pose …); before the column may stand a sign or `factor*`, behind
    it a unit in brackets and an offset in that unit. NAME=none takes a guess back. Raises `InputError` that names the entry where it
    is not of that form, names what there is not, or leaves a quantity without some of its columns.
    """
    names = {quantity: assigned_names(quantity, model.n) for quantity in (*NUMBERED, *UNITS, *ORIENTATIONS)}
    placed, texts = dict(guess.placed), dict(guess.texts)
    said: dict[str, dict[int, tuple[str, str | None, float, float]]] = {}
    for entry in _entries(given):
        name, equals, source = entry.partition("=")
        name, source = name.strip(), source.strip()
        if not equals or not source:
            raise InputError("E-IMPORT-012", f"--map {entry}: it is written NAME=COLUMN, as in q1=J1[deg].")
        if name in _TEXTS:
            if source == "none":
                texts.pop(name, None)
            elif source in foreign.table.columns:
                texts[name] = source
            else:
                raise _no_column(entry, source, foreign)
            continue
        quantity = next((q for q, columns in names.items() if name in columns or name == q), None)
        if quantity is None and name in foreign.table.columns:
            raise InputError(
                "E-IMPORT-013",
                f"--map {entry}: flexcal's name comes first, then the file's column, as in q1={name}.",
            )
        if quantity is None:
            known = [column for columns in names.values() for column in columns]
            near = (
                suggestion(name, known)
                or f"; known are q1 … q{model.n}, x, y, z, t, tau1 … tau{model.n} and others."
            )
            raise InputError("E-IMPORT-014", f"--map {entry}: there is no '{name}'{near}")
        if source == "none":
            placed.pop(quantity, None)
        elif name not in names[quantity]:
            raise InputError(
                "E-IMPORT-015", f"--map {entry}: say it for each of {', '.join(names[quantity])}."
            )
        else:
            said.setdefault(quantity, {})[names[quantity].index(name)] = _source(
                entry, quantity, source, foreign
            )
    for quantity, entries in said.items():
        placed[quantity] = _said(quantity, entries, placed.get(quantity), names[quantity], foreign, model)
    mapped = {column for quantity in said for column in placed[quantity].columns}
    for quantity in placed.keys() - said.keys():
        if mapped & set(placed[quantity].columns):
            placed.pop(quantity)
    taken = {column for assignment in placed.values() for column in assignment.columns} | set(texts.values())
    reasons = {left.column: left.why for left in guess.left_out}
    left = tuple(
        UnusedColumn(column, reasons.get(column, "not mapped"))
        for column in foreign.table.columns
        if column not in taken
    )
    return RecognisedColumns(placed, texts, left)


def _entries(given: Sequence[str]) -> list[str]:
    """Split at commas, but only where what follows is another NAME=."""
    return [part for text in given for part in re.split(r",\s*(?=\w+=)", text) if part.strip()]


def _source(
    entry: str, quantity: str, source: str, foreign: ForeignTable
) -> tuple[str, str | None, float, float]:
    """Column, unit, gain and offset."""
    match = _FACTOR.match(source)
    assert match is not None
    gain = float(match[2] or 1.0) * (-1.0 if match[1] == "-" else 1.0)
    if not 0 < abs(gain) < float("inf"):
        raise InputError("E-IMPORT-016", f"--map {entry}: the factor must be a finite number other than 0.")
    rest, offset, unit = match[3].strip(), 0.0, None
    if source in foreign.numbers:
        rest, gain = source, 1.0
    if rest not in foreign.numbers and (behind := _OFFSET.match(rest)):
        rest, offset = behind[1], float(behind[2].replace(" ", ""))
    if rest not in foreign.numbers and (bracket := _UNIT.match(rest)):
        rest, unit = bracket[1], bracket[2]
        if unit not in units_of(quantity):
            unit = unit_of(unit)
        if unit not in units_of(quantity):
            possible = ", ".join(units_of(quantity)) or "none"
            raise InputError(
                "E-IMPORT-017",
                f"--map {entry}: the unit '{bracket[2]}' does not fit; possible are {possible}.",
            )
    if rest in foreign.texts:
        raise InputError("E-IMPORT-018", f"--map {entry}: the column '{rest}' holds texts, not numbers.")
    if rest not in foreign.numbers:
        raise _no_column(entry, rest, foreign)
    if unit in ("A", "mA") and "*" not in source:
        raise InputError(
            "E-IMPORT-019",
            f"--map {entry}: currents become torques by a gain in N m/A, as in tau1=12.5*I1[A].",
        )
    return rest, unit, gain, offset


def _no_column(entry: str, column: str, foreign: ForeignTable) -> InputError:
    known = list(foreign.table.columns)
    near = suggestion(column, known) or f"; there are {', '.join(known)}."
    return InputError(
        "E-IMPORT-020", f"--map {entry}: {foreign.table.file.path} has no column '{column}'{near}"
    )


def _said(
    quantity: str,
    entries: dict[int, tuple[str, str | None, float, float]],
    guessed: ColumnAssignment | None,
    names: Sequence[str],
    foreign: ForeignTable,
    model: RobotModel,
) -> ColumnAssignment:
    """Assignment from the stated parts and the guess for the rest; a missing unit is that of the name, else the guessed one."""
    missing = [name for i, name in enumerate(names) if i not in entries]
    if missing and guessed is None:
        raise InputError(
            "E-IMPORT-021",
            f"--map does not give {', '.join(missing)}, which was not recognised either; map it too.",
        )
    assigned = []
    for i in range(len(names)):
        if i in entries:
            assigned.append(entries[i])
        elif guessed is not None:
            assigned.append((guessed.columns[i], guessed.units[i], guessed.gains[i], guessed.offsets[i]))
    columns, units, gains, offsets = zip(*assigned, strict=True)
    usual = guessed.units if guessed is not None else place(foreign, model, quantity, columns, "").units
    known = units_of(quantity)
    named = [parse_name(column, foreign.units.get(column)).unit for column in columns]
    either = tuple(
        unit or (name if name in known else other)
        for unit, name, other in zip(units, named, usual, strict=True)
    )
    return ColumnAssignment(quantity, columns, either, "--map", gains, offsets)
