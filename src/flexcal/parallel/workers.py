"""Interface of what runs tasks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

from flexcal.parallel.outcome import Outcome

V = TypeVar("V")


class Workers(ABC):
    """Where tasks run. Values do not depend on it; only the order of the outcomes does."""

    @property
    @abstractmethod
    def count(self) -> int:
        """Number of tasks that run at the same time."""

    @abstractmethod
    def results(self, function: Callable[..., V], tasks: Iterable[Any], *common: Any) -> Iterator[Outcome[V]]:
        """Outcomes of `function(task, *common)`, one for every task, in the order in which they end.

        Tasks are taken from the iterable as workers become free. `common` is sent to every worker once, not with every task. An
        exception in a task is its outcome. The tasks that ran in a worker that was killed run again, and are counted once. Where the
        iterator is closed before its end, the tasks that are left are cancelled.
        """

    @abstractmethod
    def close(self) -> None:
        """End the workers that were started for this object, and the connections to others."""
