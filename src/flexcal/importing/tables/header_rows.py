"""Detection of the header in a grid of cells: notes, names, units, then rows of numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from flexcal.data.tables import MOST_COLUMNS, STAMP
from flexcal.errors import InputError
from flexcal.importing.tables.column_names import is_unit

NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")


@dataclass(frozen=True)
class Header:
    """Names of the columns, units from a row under them, and the index of the first row; `named` False: there are no names."""

    names: tuple[str, ...]
    units: Mapping[str, str]
    first: int
    named: bool
    notes: tuple[str, ...]


def find_header(path: Path, rows: Sequence[Sequence[str]], width: int, row_word: str) -> Header:
    """The header of a table `width` wide: the row before the first of which half is numbers and times, or before a row of units.

    Raises `InputError` where there is no row of numbers, the names are not as many as the values, or one stands twice.
    """
    if width > MOST_COLUMNS:
        raise InputError(
            "E-IMPORT-075",
            f"{path}: its rows have {width} values, and a table has up to {MOST_COLUMNS} columns; check that it is the right file.",
        )
    first = next((i for i, cells in enumerate(rows) if len(cells) == width and _is_data(cells)), None)
    if first is None:
        raise InputError(
            "E-IMPORT-053", f"{path}: there is no row of numbers in it; export the measurements again."
        )
    above = [i for i in range(first) if any(cell for cell in rows[i])]
    if not above:
        return Header(tuple(f"c{k + 1}" for k in range(width)), {}, first, False, ())
    at, units = above[-1], {}
    if len(above) > 1 and len(rows[at]) == width and all(is_unit(cell) or not cell for cell in rows[at]):
        at = above[-2]
        units = {name: unit for name, unit in zip(rows[at], rows[above[-1]], strict=False) if unit}
    place = f"{path} {row_word} {at + 1}"
    if len(rows[at]) != width:
        raise InputError(
            "E-IMPORT-054",
            f"{place}: the header has {len(rows[at])} names, but the rows have {width} values; make them as many.",
        )
    names = tuple(name or f"c{k + 1}" for k, name in enumerate(rows[at]))
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise InputError(
            "E-IMPORT-055", f"{place}: the column '{twice[0]}' stands twice; rename or remove one."
        )
    notes = (f"what precedes the header in {row_word} {at + 1} was skipped",) if at > above[0] else ()
    return Header(names, units, first, True, notes)


def _is_data(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    return bool(filled) and 2 * sum(bool(NUMBER.fullmatch(c) or STAMP.fullmatch(c)) for c in filled) >= len(
        cells
    )
