"""Parquet with any columns."""

from __future__ import annotations

from pathlib import Path

from flexcal.errors import InputError
from flexcal.importing.foreign_table import ForeignTable
from flexcal.importing.frames import table_of


def read_parquet(path: Path) -> ForeignTable:
    """Read a Parquet file; raises `InputError` where it is none."""
    import polars as pl

    try:
        frame = pl.read_parquet(path)
    except (pl.exceptions.PolarsError, OSError) as problem:
        reason = " ".join(str(problem).split())
        raise InputError(f"{path}: not a readable Parquet file ({reason}); export it again.") from problem
    return table_of(path, frame, 1)
