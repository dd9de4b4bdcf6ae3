"""Results of a study on disk: one row a task, in Parquet."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexcal.data.tables import require_decodable
from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import atomic_path, current_path, regular_path

if TYPE_CHECKING:
    import polars

TASKS = "tasks.parquet"
"""All rows of a study that has ended."""
PARTS = "parts"
"""Folder of the rows of a study that runs, a file for each second or more of it."""
_PATTERN = "part_*.parquet"
KEY, NUMBER = "task", "number"


@dataclass(frozen=True)
class StudyRows:
    """Rows that are stored in a folder, by the number of the task, and the names of files that cannot be read."""

    frame: polars.DataFrame
    damaged: tuple[Path, ...]


def read_study_rows(folder: Path) -> StudyRows:
    """Rows of all tables of a study. A part that was cut off or changed is among the `damaged`; there may be none."""
    import polars

    frames, damaged = [], []
    for path in _tables(folder):
        try:
            require_decodable(path, stream=False)
            frames.append(polars.read_parquet(regular_path(path, limit=None), memory_map=False))
        except (OSError, InputError, polars.exceptions.PolarsError) as problem:
            if isinstance(problem, PermissionError):
                raise unreadable(path, problem) from problem
            damaged.append(path)
    frames = [frame for frame in frames if KEY in frame.columns and NUMBER in frame.columns]
    if not frames:
        return StudyRows(
            polars.DataFrame({KEY: [], NUMBER: []}, {KEY: polars.String, NUMBER: polars.Int64}),
            tuple(damaged),
        )
    joined = polars.concat(frames, how="diagonal_relaxed").unique(KEY, keep="last", maintain_order=True)
    return StudyRows(joined.sort(NUMBER), tuple(damaged))


def write_part(folder: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Store rows in a new part; raises `InputError` where that is not possible, and nothing that was stored changes."""
    import polars

    numbers = [int(path.stem.removeprefix("part_")) for path in (folder / PARTS).glob(_PATTERN)]
    path = folder / PARTS / f"part_{max(numbers, default=0) + 1:06}.parquet"
    with atomic_path(path) as temporary:
        _written(polars.DataFrame(list(rows), infer_schema_length=None), temporary)


def write_tasks(folder: Path, frame: polars.DataFrame) -> None:
    """Store all rows as one table, atomically."""
    with atomic_path(folder / TASKS) as temporary:
        _written(frame, temporary)


def has_parts(folder: Path) -> bool:
    """Whether a study has stored parts in a folder."""
    return any((folder / PARTS).glob(_PATTERN))


def remove_parts(folder: Path) -> None:
    """Remove the parts of a study whose rows are all in one table, damaged ones too."""
    for path in (folder / PARTS).glob(_PATTERN):
        path.unlink()


def _written(frame: polars.DataFrame, path: Path) -> None:
    """Write a table; a full disk is an `OSError`, whatever Polars makes of it."""
    import polars

    try:
        frame.write_parquet(path, compression="zstd")
    except polars.exceptions.PolarsError as problem:
        if "os error 28" in str(problem):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) from problem
        raise


def _tables(folder: Path) -> list[Path]:
    whole = [folder / TASKS] if current_path(folder / TASKS).is_file() else []
    return [*whole, *sorted((folder / PARTS).glob(_PATTERN))]
