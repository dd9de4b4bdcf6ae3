"""Results of a study on disk: one row a task, in Parquet, and in JSON lines while the study runs."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexcal.data.tables import require_decodable
from flexcal.errors import InputError, unreadable
from flexcal.files.formats import json_values, parse_json
from flexcal.files.transaction import (
    append_lines,
    atomic_path,
    current_path,
    refuse_irregular,
    regular_path,
    whole_lines,
)

if TYPE_CHECKING:
    import polars

TASKS = "tasks.parquet"
"""All rows of a study that has ended."""
ROWS = "tasks.jsonl"
"""Rows of a study that runs, as its tasks end."""
KEY, NUMBER = "task", "number"


@dataclass(frozen=True)
class StudyRows:
    """Rows that are stored in a folder, by the number of the task, and what could not be read, in words."""

    frame: polars.DataFrame
    damaged: tuple[str, ...]


def read_study_rows(folder: Path) -> StudyRows:
    """Rows of all tables of a study. Lines and tables that were changed are among the `damaged`; there may be none."""
    import polars

    frames, damaged = [], []
    if current_path(folder / TASKS).is_file():
        try:
            require_decodable(folder / TASKS, stream=False)
            table = regular_path(folder / TASKS, limit=None)
            frames.append(polars.read_parquet(table, memory_map=False))
        except (OSError, InputError, polars.exceptions.PolarsError) as problem:
            if isinstance(problem, PermissionError):
                raise unreadable(folder / TASKS, problem) from problem
            damaged.append(str(folder / TASKS))
    rows, odd = _read_rows(folder / ROWS)
    if rows:
        frames.append(polars.DataFrame(rows, infer_schema_length=None, strict=False))
    if odd:
        damaged.append(f"{odd} lines of {folder / ROWS}")
    frames = [frame for frame in frames if KEY in frame.columns and NUMBER in frame.columns]
    if not frames:
        return StudyRows(
            polars.DataFrame({KEY: [], NUMBER: []}, {KEY: polars.String, NUMBER: polars.Int64}),
            tuple(damaged),
        )
    joined = polars.concat(frames, how="diagonal_relaxed").unique(KEY, keep="last", maintain_order=True)
    return StudyRows(joined.sort(NUMBER), tuple(damaged))


def append_rows(folder: Path, rows: Sequence[Mapping[str, Any]], *, synchronised: bool) -> None:
    """Store rows; raises `InputError` and `OSError` where that is not possible, and nothing that was stored changes."""
    lines = (json.dumps(json_values(row), allow_nan=False) for row in rows)
    append_lines(folder / ROWS, lines, synchronised=synchronised)


def write_tasks(folder: Path, frame: polars.DataFrame) -> None:
    """Store all rows as one table, atomically."""
    import polars

    with atomic_path(folder / TASKS) as temporary:
        try:
            frame.write_parquet(temporary, compression="zstd")
        except polars.exceptions.PolarsError as problem:
            # a full disk is an `OSError`, whatever Polars makes of it
            if "os error 28" in str(problem):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) from problem
            raise


def has_rows(folder: Path) -> bool:
    """Whether a study has stored rows in a folder."""
    return (folder / ROWS).is_file()


def remove_rows(folder: Path) -> None:
    """Remove the rows of a study that are all in one table."""
    refuse_irregular(folder / ROWS)
    (folder / ROWS).unlink(missing_ok=True)


def _read_rows(path: Path) -> tuple[list[dict[str, Any]], int]:
    """Rows of the whole lines of a file, and the number of lines that are none."""
    rows, odd = [], 0
    try:
        for line in whole_lines(path):
            try:
                row = parse_json(path, line, "")
            except InputError:
                row = None
            known = (
                isinstance(row, dict)
                and isinstance(row.get(KEY), str)
                and isinstance(row.get(NUMBER), int)
                and all(value is None or isinstance(value, str | int | float) for value in row.values())
            )
            rows += [row] if known else []
            odd += not known
    except OSError as problem:
        raise unreadable(path, problem) from problem
    return rows, odd
