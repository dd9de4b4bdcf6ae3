"""Table of the columns of an imported file, with their meaning and unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from flexcal.data.tables import standard_columns

if TYPE_CHECKING:
    from flexcal.jobs.setup import ImportedFile

_ROWS = 3


def first_rows_table(imported: ImportedFile) -> Table:
    """One row a column of flexcal: the file's column, its unit, the first values in SI, and why."""
    what = {"poses": "measured poses", "log": "a log of joints", "joints": "joint positions"}[imported.kind]
    rows = len(next(iter(imported.columns.values())))
    table = Table(title=f"{imported.file}: {what}, {rows} rows; the first in SI units", title_justify="left")
    table.add_column("")
    table.add_column("column")
    table.add_column("unit")
    for number in range(min(_ROWS, rows)):
        table.add_column(f"row {number + 1}", justify="right")
    table.add_column("recognised by")
    listed = set()
    for placed in imported.placed:
        names = standard_columns(placed.quantity, imported.model.n)
        for i, name in enumerate(names):
            listed.add(name)
            sign = "" if placed.gains[i] == 1 else "−" if placed.gains[i] == -1 else f"{placed.gains[i]:g} · "
            offset = f" {placed.offsets[i]:+g}" if placed.offsets[i] else ""
            column = f"{sign}{placed.columns[i]}{offset}"
            table.add_row(
                name,
                column,
                placed.units[i] or "",
                *_first(imported, name),
                placed.why if not i else "″",
            )
    given = {"pose": "rows are numbered", "sigma": "--sigma"}
    if imported.orientations is not None:
        given |= dict.fromkeys(
            ("qw", "qx", "qy", "qz"), ", ".join(imported.orientations.source.placed.columns)
        )
    for name in imported.columns:
        if name not in listed:
            table.add_row(name, "", "", *_first(imported, name), given.get(name, "its name"))
    return table


def _first(imported: ImportedFile, name: str) -> list[str]:
    values = imported.columns[name][:_ROWS]
    return [f"{value:.6g}" if values.dtype.kind == "f" else str(value) for value in values]
