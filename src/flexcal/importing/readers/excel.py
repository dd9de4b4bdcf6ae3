"""Sheets of Excel files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.tables import Table, TableFile
from flexcal.errors import InputError
from flexcal.importing.readers.separated_text import values
from flexcal.importing.tables import ForeignTable, find_header


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
    try:
        book = fastexcel.read_excel(path)
        names = book.sheet_names
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
    except fastexcel.FastExcelError as problem:
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


def _columns(sheet: Any) -> list[list[Any]]:
    return [series.to_list() for series in sheet.to_polars().get_columns()]


def _column(cells: list[Any]) -> np.ndarray:
    numbers = [isinstance(cell, int | float) for cell in cells]
    if any(numbers) and all(number or cell is None for number, cell in zip(numbers, cells, strict=True)):
        return np.array([np.nan if cell is None else cell for cell in cells], dtype=float)
    return values(["" if cell is None else str(cell) for cell in cells])
