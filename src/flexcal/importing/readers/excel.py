"""Sheets of Excel files."""

from __future__ import annotations

import logging
import os
import re
import zlib
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile, is_zipfile

import numpy as np

from flexcal.data.tables import Table, TableFile
from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import MEGABYTE, open_regular, regular_path, size_text, unpacked_limit
from flexcal.importing.readers.separated_text import values
from flexcal.importing.tables import ForeignTable, find_header

_LARGEST = 64 * MEGABYTE
_LARGEST_UNPACKED = 1000 * MEGABYTE
_MOST_CELLS = 20_000_000
"""Largest number of cells between the first and the last of a sheet: all of them are held, filled or not."""
_PLACE = re.compile(rb"""r(?<=\sr)\s*=\s*["']([A-Z]{0,3})([0-9]{1,7})["']""")
"""Column and row of a cell, or the row of a row."""
_OVERLAP = 64
"""Bytes of a part of a sheet that are looked at again with the next one."""


def read_excel(path: Path, sheet: str | None) -> ForeignTable:
    """Read one sheet of an Excel or OpenDocument file, the first without `sheet`; what precedes its header is passed over.

    Raises `InputError` where fastexcel is not installed, the file is none, or there is no such sheet.
    """
    try:
        import fastexcel
    except ImportError:
        raise InputError(
            "E-IMPORT-025",
            f"{path}: Excel files need fastexcel: pip install fastexcel; or save the sheet as CSV.",
        ) from None
    _require_size(path)
    logging.getLogger("fastexcel").setLevel(logging.CRITICAL)  # it tells what the sentences here tell
    try:
        book = fastexcel.read_excel(regular_path(path, limit=_LARGEST))
        names = book.sheet_names
        if not names:
            raise InputError("E-IMPORT-076", f"{path} has no sheet; save the measurements again.")
        if sheet is not None and sheet not in names:
            raise InputError(
                "E-IMPORT-026", f"{path}: there is no sheet '{sheet}'; there are {', '.join(names)}."
            )
        chosen = names[0] if sheet is None else sheet
        texts = _columns(book.load_sheet(chosen, header_row=None, dtypes="string"))
        rows = [[cell or "" for cell in row] for row in zip(*texts, strict=True)]
        if not rows:
            raise InputError(
                "E-IMPORT-027", f"{path}: the sheet '{chosen}' is empty; name another one with --sheet."
            )
        header = find_header(path, rows, len(texts), "row")
        exact = _columns(book.load_sheet(chosen, header_row=None, skip_rows=header.first))
    except InputError:
        raise
    except Exception as problem:  # whatever a reader of a broken file may raise
        reason = " ".join(str(problem).split())[:200]
        raise InputError(
            "E-IMPORT-028", f"{path}: not a readable Excel file ({reason}); save it again."
        ) from problem
    columns = {name: _column(cells) for name, cells in zip(header.names, exact, strict=True)}
    first = header.first + 1
    others = [name for name in names if name != chosen]
    notes = header.notes + (
        (f"of the sheets only '{chosen}' was read; --sheet names another",) if others else ()
    )
    table = Table(TableFile(path, header.names, first), first, columns)
    return ForeignTable(table, header.units, header.named, notes)


def _require_size(path: Path) -> None:
    """Raise `InputError` for a file that is too large when it is unpacked, or has a cell too far from the first one."""
    try:
        with open_regular(path, limit=_LARGEST) as stream:
            if not is_zipfile(stream):  # as the .xls of old
                return
            with ZipFile(stream) as book:
                size, limit = 0, unpacked_limit(os.fstat(stream.fileno()).st_size, _LARGEST_UNPACKED)
                members = book.infolist()
                declared = sum(member.file_size for member in members)
                for member in members:
                    rows = columns = 1
                    beginning = b""
                    with book.open(member) as part:
                        while content := part.read(2**20):
                            size += len(content)
                            for column, row in _PLACE.findall(beginning + content):
                                rows, columns = max(rows, int(row)), max(columns, _number(column))
                            if max(size, declared) > limit or rows * columns > _MOST_CELLS:
                                raise InputError(
                                    "E-IMPORT-073",
                                    f"{path}: {member.filename} in it is too large (a sheet has up to {_MOST_CELLS} cells, and a file "
                                    f"{size_text(limit)}); save the sheet as CSV.",
                                )
                            beginning = content[-_OVERLAP:]
    except OSError as problem:
        raise unreadable(path, problem) from problem
    except (BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError) as problem:
        raise InputError(
            "E-IMPORT-074", f"{path}: not a readable Excel file (its parts are damaged); save it again."
        ) from problem


def _number(column: bytes) -> int:
    """Number of a column that is called by letters; 0 of none."""
    number = 0
    for letter in column:
        number = 26 * number + letter - 64
    return number


def _columns(sheet: Any) -> list[list[Any]]:
    return [series.to_list() for series in sheet.to_polars().get_columns()]


def _column(cells: list[Any]) -> np.ndarray:
    numbers = [isinstance(cell, int | float) for cell in cells]
    if any(numbers) and all(number or cell is None for number, cell in zip(numbers, cells, strict=True)):
        return np.array([np.nan if cell is None else cell for cell in cells], dtype=float)
    return values(["" if cell is None else str(cell) for cell in cells])
