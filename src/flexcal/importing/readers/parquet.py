"""Parquet files and polars frames as foreign tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.tables import Table, TableFile, require_decodable
from flexcal.errors import InputError
from flexcal.files.transaction import regular_path
from flexcal.importing.tables import ForeignTable

if TYPE_CHECKING:
    import polars as pl


def table_of(path: Path, frame: pl.DataFrame, first: int) -> ForeignTable:
    """Numbers and texts of a frame whose first row is called `first`; lists of as many numbers each become columns name[0], name[1], …,
    times seconds from the first.

    Raises `InputError` where there are no rows.
    """
    import polars as pl

    if not len(frame):
        raise InputError("E-IMPORT-033", f"{path}: the table has a header but no rows; add some.")
    columns: dict[str, np.ndarray] = {}
    notes, times = [], []
    for name, series in zip(frame.columns, frame.get_columns(), strict=True):
        if series.dtype.is_numeric() or series.dtype == pl.Boolean:
            columns[name] = series.cast(pl.Float64).fill_null(np.nan).to_numpy()
        elif series.dtype == pl.String:
            columns[name] = np.array([value or "" for value in series], dtype=str)
        elif series.dtype.is_temporal():
            first_of = series.drop_nulls()
            stamps = series.cast(pl.Datetime("us")).cast(pl.Int64)
            columns[name] = (stamps - stamps.drop_nulls().first()).cast(pl.Float64).fill_null(
                np.nan
            ).to_numpy() * 1e-6
            notes.append(f"{name} counts in seconds from {first_of[0]}")
            times.append(name)
        elif isinstance(series.dtype, pl.List | pl.Array):
            lengths = {len(value) if value is not None else 0 for value in series}
            if len(lengths) == 1:
                values = np.array(series.to_list(), dtype=float)
                columns |= {f"{name}[{k}]": values[:, k] for k in range(values.shape[1])}
            else:
                notes.append(f"{name} holds lists of different lengths and is left out")
        else:
            notes.append(f"{name} holds {series.dtype} and is left out")
    table = Table(TableFile(path, tuple(columns), first), first, columns)
    return ForeignTable(table, notes=tuple(notes), times=tuple(times))


def read_parquet(path: Path) -> ForeignTable:
    """Read a Parquet file; raises `InputError` where it is none."""
    import polars as pl

    try:
        pl.read_parquet_schema(regular_path(path, limit=None))
        require_decodable(path, stream=False)
        frame = pl.read_parquet(regular_path(path, limit=None))
    except (pl.exceptions.PolarsError, OSError) as problem:
        reason = " ".join(str(problem).split())
        raise InputError(
            "E-IMPORT-034", f"{path}: not a readable Parquet file ({reason}); export it again."
        ) from problem
    return table_of(path, frame, 1)
