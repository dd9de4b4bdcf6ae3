"""Interface of the tasks of a study."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from flexcal.jobs.study.rows import StudyRow
from flexcal.model.robot import unit_of


class StudyTasks(ABC):
    """What all tasks of a study have in common, and what each does with its row. It travels to the workers, which need no files."""

    options: ClassVar[type]
    """Class of the options."""
    has_truth: ClassVar[bool]
    """Whether true values of the parameters are known."""

    origin: Mapping[str, str]
    """Provenance: the program and the SHA-256 of all files that the results depend on."""

    @property
    @abstractmethod
    def cell(self) -> Mapping[str, Any]:
        """Settings of the cell that options of the study change; empty where there are none."""

    @property
    def error(self) -> str:
        """Which errors are the result: those of the columns `<error>.mean_mm`, `<error>.p90_mm` and `<error>.max_mm`."""
        return "verification"

    @property
    def resamples(self) -> Sequence[str]:
        """Data sets of every combination of options."""
        return ("",)

    def unit(self, parameter: str) -> str:
        """SI unit of a parameter."""
        return unit_of(parameter)

    def require(self, options: Mapping[str, Any]) -> None:
        """Raise `FlexcalError` where no task could run with these `options` by name; by default all can that have the right types."""
        del options

    @abstractmethod
    def result(self, row: StudyRow) -> dict[str, Any]:
        """Columns of a row's results: a pure function of the row. Raises `FlexcalError` where it cannot be computed."""


def run_row(row: StudyRow, tasks: StudyTasks) -> dict[str, Any]:
    """Columns of a row's results."""
    return tasks.result(row)
