"""Choice of the reader of a file by its name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from flexcal.data.tables import Table, seconds_of, tables_in
from flexcal.errors import InputError
from flexcal.importing.tables import ForeignTable


def with_times(foreign: ForeignTable) -> ForeignTable:
    """`foreign` with texts most of which are timestamps as seconds from the first of their column, named in `times`."""
    times = {}
    for name, texts in foreign.texts.items():
        seconds = seconds_of(texts.tolist())
        if seconds is not None:
            times[name] = seconds
    if not times:
        return foreign
    notes = [
        f"{name} counts in seconds from {foreign.texts[name][np.isfinite(seconds)][0]}"
        for name, seconds in times.items()
    ]
    table = Table(foreign.table.file, foreign.table.first, {**foreign.table.columns, **times})
    return replace(foreign, table=table, notes=(*foreign.notes, *notes), times=(*foreign.times, *times))


_TEXT = (".csv", ".tsv", ".txt", ".dat", ".asc")
_EXCEL = (".xlsx", ".xlsm", ".xls", ".xlsb", ".ods")
_UFF = (".uff", ".unv")
_ROS = (".mcap", ".db3", ".bag")


def read_foreign(
    path: Path, joints: Sequence[str], *, sheet: str | None = None, topic: str | None = None
) -> ForeignTable:
    """Read a table of another program: text with separators, Excel, MAT, Parquet, universal, or a ROS recording; timestamps become seconds.

    `joints` are the robot's, by which a recording's messages are chosen; `sheet` is that of an Excel file, `topic` that of the points in
    a recording. Raises `InputError` where the file cannot be read, and where the library for it is not installed.
    """
    return with_times(_read(path, joints, sheet, topic))


def _read(path: Path, joints: Sequence[str], sheet: str | None, topic: str | None) -> ForeignTable:
    suffix = path.suffix.lower()
    if not path.exists():
        raise InputError("E-IMPORT-022", f"{path}: there is no such file; check the name and the folder.")
    if suffix in _ROS or (path.is_dir() and (path / "metadata.yaml").is_file()):
        from flexcal.importing.readers.ros import read_ros

        return read_ros(path, joints, topic)
    if path.is_dir():
        raise InputError(
            "E-IMPORT-023",
            f"{path} is a folder without metadata.yaml, so no recording of ROS 2; name a file{tables_in(path)}.",
        )
    if suffix in _TEXT:
        from flexcal.importing.readers.separated_text import read_text

        return read_text(path)
    if suffix in _EXCEL:
        from flexcal.importing.readers.excel import read_excel

        return read_excel(path, sheet)
    if suffix == ".mat":
        from flexcal.importing.readers.matlab import read_mat

        return read_mat(path)
    if suffix in _UFF:
        from flexcal.importing.readers.universal_files import read_uff

        return read_uff(path)
    if suffix == ".parquet":
        from flexcal.importing.readers.parquet import read_parquet

        return read_parquet(path)
    known = ", ".join((*_TEXT, *_EXCEL[:2], ".mat", ".parquet", _UFF[0], *_ROS))
    raise InputError(
        "E-IMPORT-024", f"{path}: files that end in '{suffix}' are not supported; supported are {known}."
    )
