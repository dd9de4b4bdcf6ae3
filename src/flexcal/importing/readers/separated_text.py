"""Tables as text: commas, semicolons, tabs or spaces, decimal points or commas, whatever precedes the header."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flexcal.data.tables import Table, TableFile
from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import MEGABYTE, read_bytes
from flexcal.importing.tables import NUMBER, ForeignTable, find_header

_LARGEST = 512 * MEGABYTE
_SEPARATORS = ("\t", ";", ",", " ")
_LOOKED_AT = 200
"""Number of rows searched for the header, and of the last ones that determine the separator."""


def read_text(path: Path) -> ForeignTable:
    """Read a table of text; raises `InputError` where it is empty or its rows have different lengths.

    The separator is the first of tab, semicolon, comma and space that splits the rows of the second half into as many cells each, else
    most of them.
    """
    try:
        return _read(path, _decoded(path).splitlines())
    except csv.Error as problem:
        raise InputError(
            "E-IMPORT-041",
            f"{path} holds a cell that cannot be read ({problem}); export the measurements again.",
        ) from problem


def _read(path: Path, lines: list[str]) -> ForeignTable:
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise InputError("E-IMPORT-042", f"{path} line 1: the file is empty; it needs a header and rows.")
    half = lines[len(lines) // 2 :][-_LOOKED_AT:]
    last = [line for line in half if line.strip() and not line.startswith("#")] or lines
    separator, width = _separator(path, last)
    header = find_header(path, [_cells(line, separator) for line in lines[:_LOOKED_AT]], width, "line")
    body = lines[header.first :]
    comma = separator != "," and any("," in cell for line in last for cell in _cells(line, separator))
    columns = _parsed(body, separator, header.names, comma)
    if columns is None:
        rows = _rows(path, body, header.first + 1, separator, width)
        columns = {name: values([row[k] for row in rows], comma) for k, name in enumerate(header.names)}
    first = header.first + 1
    table = Table(TableFile(path, header.names, first), first, columns)
    return ForeignTable(table, header.units, header.named, header.notes)


def _parsed(
    body: Sequence[str], separator: str, names: Sequence[str], comma: bool
) -> dict[str, np.ndarray] | None:
    """The columns (N,) of rows that hold numbers alone, quickly; None where there is anything else."""
    import polars as pl

    if separator == " ":
        return None
    schema = dict.fromkeys(names, pl.Float64)
    content = io.BytesIO("\n".join(body).encode())
    try:
        frame = pl.read_csv(
            content, has_header=False, schema=schema, separator=separator, decimal_comma=comma
        )
    except pl.exceptions.PolarsError:
        return None
    if len(frame) != len(body) or any(series.null_count() for series in frame.get_columns()):
        return None
    return {name: frame[name].to_numpy() for name in names}


def values(cells: Sequence[str], comma: bool = False) -> np.ndarray:
    """Numbers (N,), NaN for what is none, or texts (N,) where most cells are none; with `comma`, decimal commas."""
    plain = [cell.replace(",", ".") for cell in cells] if comma else cells
    try:
        return np.array(plain, dtype=float)
    except ValueError:
        numbers = np.array(
            [float(cell.replace(",", ".")) if NUMBER.fullmatch(cell) else np.nan for cell in plain]
        )
    filled = sum(bool(cell) for cell in cells)
    return numbers if 2 * np.isfinite(numbers).sum() > filled else np.array(cells, dtype=str)


def _decoded(path: Path) -> str:
    try:
        content = read_bytes(path, limit=_LARGEST)
    except OSError as problem:
        raise unreadable(path, problem) from problem
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]


def _separator(path: Path, rows: Sequence[str]) -> tuple[str, int]:
    for share in (1.0, 0.5):
        for separator in _SEPARATORS:
            (width, count), *_ = Counter(len(_cells(row, separator)) for row in rows).most_common(1)
            if width > 1 and count >= share * len(rows):
                return separator, width
    raise InputError(
        "E-IMPORT-043",
        f"{path}: its last rows are not separated into as many values each by commas, semicolons, tabs or spaces; "
        "export it again as CSV.",
    )


def _rows(path: Path, body: Sequence[str], first: int, separator: str, width: int) -> list[list[str]]:
    rows = []
    for number, line in enumerate(body, start=first):
        cells = _cells(line, separator)
        if not any(cells):
            raise InputError("E-IMPORT-044", f"{path} line {number}: the line is empty; remove it.")
        if len(cells) != width:
            raise InputError(
                "E-IMPORT-045",
                f"{path} line {number}: there are {len(cells)} values, but {width} columns; complete the line or remove it.",
            )
        rows.append(cells)
    return rows
