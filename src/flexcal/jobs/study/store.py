"""Rows of a study that runs, stored as they end."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from flexcal.errors import FlexcalError, InputError
from flexcal.files.transaction import sole_holder
from flexcal.jobs.result_files import KEY, NUMBER, append_rows
from flexcal.jobs.study.rows import StudyRow
from flexcal.parallel import Outcome

_EVERY, _SHARE = 1.0, 0.01
"""Least seconds between two synchronisations to disk, and least share of the time that the study has run."""
FIRST = (KEY, NUMBER, "seed", "resample", "seconds", "error_code", "error")
"""Columns that every row has."""
OPTION = "option."
"""Prefix of the columns of options."""


class StudyStore:
    """Appends outcomes to the rows in the folder of a study; they are there where the process is killed, and a second or more of them is
    lost at most where the machine stops."""

    def __init__(self, folder: Path, stored: int, total: int):
        self._folder, self.stored, self._total = folder, stored, total
        self._started = self._synchronised = time.monotonic()

    def add(self, number: int, row: StudyRow, outcome: Outcome[dict[str, Any]]) -> None:
        """Store the outcome of the task of a row; raises `FlexcalError` where it cannot be stored, as on a full disk."""
        now = time.monotonic()
        due = now - self._synchronised > max(_EVERY, _SHARE * (now - self._started))
        try:
            append_rows(self._folder, [columns(number, row, outcome)], synchronised=due)
        except (InputError, OSError) as problem:
            reason = (
                str(problem)
                if isinstance(problem, InputError)
                else f"{self._folder} could not be written ({problem.strerror})."
            )
            raise FlexcalError(
                "E-STUDY-017",
                f"{reason} {self.stored} of {self._total} tasks are stored; make space, and go on with --resume.",
            ) from problem
        self.stored += 1
        if due:
            self._synchronised = now


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
    with sole_holder(folder, "study", "another 'flexcal study'") as other:
        if other is not None:
            raise InputError(
                "E-STUDY-018", f"{other} is at work in {folder}; wait for its end, or give another --out."
            )
        folder.mkdir(parents=True, exist_ok=True)
        yield
