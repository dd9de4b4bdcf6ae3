"""Outcome of one task."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from flexcal.errors import FlexcalError

V = TypeVar("V")


@dataclass(frozen=True)
class TaskError:
    """Why a task has no value: the code and sentence of a `FlexcalError`, or the type and text of another exception without a code."""

    code: str | None
    sentence: str

    @staticmethod
    def of(problem: BaseException) -> TaskError:
        """The error that an exception tells, on one line."""
        if isinstance(problem, FlexcalError):
            return TaskError(problem.code, str(problem))
        return TaskError(None, " ".join(f"{type(problem).__name__}: {problem}".split()))


@dataclass(frozen=True)
class Outcome(Generic[V]):
    """What became of a task: `value`, or `error` where it failed, after `seconds` s; `index` counts the tasks from 0."""

    index: int
    value: V | None
    error: TaskError | None
    seconds: float


def run_task(function: Callable[..., V], index: int, task: Any, common: tuple[Any, ...]) -> Outcome[V]:
    """Outcome of `function(task, *common)`. Any exception, and an attempt to end the process, is the error of this task alone."""
    started = time.perf_counter()
    value, error = None, None
    try:
        value = function(task, *common)
    except (Exception, SystemExit) as problem:
        error = TaskError.of(problem)
    return Outcome(index, value, error, time.perf_counter() - started)
