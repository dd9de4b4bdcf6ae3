"""Rows of a study that runs, stored as they end."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from flexcal.errors import FlexcalError, InputError
from flexcal.jobs.result_files import KEY, NUMBER, PARTS, write_part
from flexcal.jobs.study.rows import StudyRow
from flexcal.parallel import Outcome

_LOCK = ".lock"
_EVERY, _SHARE = 1.0, 0.01
"""Least seconds between two parts, and least share of the time that the study has run."""
FIRST = (KEY, NUMBER, "seed", "resample", "seconds", "error_code", "error")
"""Columns that every row has."""
OPTION = "option."
"""Prefix of the columns of options."""


class StudyStore:
    """Writes outcomes to parts in the folder of a study; a second or more of work is lost at most where the process is killed."""

    def __init__(self, folder: Path, stored: int, total: int):
        self._folder, self.stored, self._total = folder, stored, total
        self._rows: list[dict[str, Any]] = []
        self._started = self._written = time.monotonic()

    def add(self, number: int, row: StudyRow, outcome: Outcome[dict[str, Any]]) -> None:
        """Take the outcome of the task of a row; raises `FlexcalError` where it cannot be stored, as on a full disk."""
        self._rows.append(columns(number, row, outcome))
        now = time.monotonic()
        if now - self._written > max(_EVERY, _SHARE * (now - self._started)):
            self.flush()

    def flush(self) -> None:
        """Write what has not been written."""
        if not self._rows:
            return
        waiting, self._rows = self._rows, []
        try:
            write_part(self._folder, waiting)
        except (InputError, OSError) as problem:
            raise FlexcalError(
                "E-STUDY-017",
                f"{problem} {self.stored} of {self._total} tasks are stored; make space, and go on with --resume.",
            ) from problem
        self.stored += len(waiting)
        self._written = time.monotonic()


def columns(number: int, row: StudyRow, outcome: Outcome[dict[str, Any]]) -> dict[str, Any]:
    """Row of the table: the task, its options, its results, and its error if it failed."""
    error = outcome.error
    return {
        KEY: row.key,
        NUMBER: number,
        "seed": row.seed,
        "resample": row.resample,
        **{f"{OPTION}{name}": option_cell(value) for name, value in row.options.items()},
        "seconds": outcome.seconds,
        "error_code": None if error is None else error.code,
        "error": None if error is None else error.sentence,
        **(outcome.value or {}),
    }


def option_cell(value: Any) -> Any:
    """Value of an option in a table: numbers and texts as they are, others as text."""
    if isinstance(value, list | tuple):
        return " ".join(str(item) for item in value)
    return value if isinstance(value, str | int | float | bool) or value is None else str(value)


@contextmanager
def exclusive(folder: Path) -> Iterator[None]:
    """Within it, no other process runs the study of this folder; raises `InputError` where one does."""
    (folder / PARTS).mkdir(parents=True, exist_ok=True)
    handle = os.open(folder / PARTS / _LOCK, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as problem:
            raise InputError(
                "E-STUDY-018",
                f"another 'flexcal study' is at work in {folder}; wait for its end, or give another --out.",
            ) from problem
        yield
        with suppress(OSError):  # there are parts
            (folder / PARTS / _LOCK).unlink()
            (folder / PARTS).rmdir()
    finally:
        os.close(handle)
