"""Tasks one after the other in this process."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from typing import Any, TypeVar

from flexcal.parallel.outcome import Outcome, run_task
from flexcal.parallel.workers import Workers

V = TypeVar("V")


class ThisProcess(Workers):
    """Runs tasks one after the other, without another process."""

    @property
    def count(self) -> int:
        """As `Workers.count`: 1."""
        return 1

    def results(
        self, function: Callable[..., V], tasks: Iterable[Any], *common: Any
    ) -> Generator[Outcome[V], None, None]:
        """As `Workers.results`, in the order of the tasks."""
        for index, task in enumerate(tasks):
            yield run_task(function, index, task, common)

    def values(self, function: Callable[..., V], tasks: Iterable[Any], *common: Any) -> Iterator[V]:
        """As `Workers.values`; the exception of a task is raised as it is."""
        return (function(task, *common) for task in tasks)

    def close(self) -> None:
        """As `Workers.close`: nothing was started."""
