"""Interface of what runs tasks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from itertools import chain
from typing import Any, TypeVar

from flexcal.parallel.ordered import combined_groups, values_in_order
from flexcal.parallel.outcome import Outcome

V = TypeVar("V")


class Workers(ABC):
    """Where tasks run. Values do not depend on it; only the order of the outcomes does."""

    @property
    @abstractmethod
    def count(self) -> int:
        """Number of tasks that run at the same time."""

    @abstractmethod
    def results(
        self, function: Callable[..., V], tasks: Iterable[Any], *common: Any
    ) -> Generator[Outcome[V], None, None]:
        """Outcomes of `function(task, *common)`, one for every task, in the order in which they end.

        Tasks are taken from the iterable as workers become free. `common` is sent to every worker once, not with every task. An
        exception in a task is its outcome. The tasks that ran in a worker that was killed run again, and are counted once. Where the
        iterator is closed before its end, the tasks that are left are cancelled.
        """

    def values(self, function: Callable[..., V], tasks: Iterable[Any], *common: Any) -> Iterator[V]:
        """`function(task, *common)` of every task, in their order. The error of a task is raised here."""
        return values_in_order(self.results(function, tasks, *common))

    def reduced(
        self,
        function: Callable[..., V],
        groups: Sequence[Sequence[Any]],
        combine: Callable[[V, V], V],
        *common: Any,
    ) -> Iterator[V]:
        """Values of every group of tasks, none empty, as one: combined pair by pair in a tree, where the tasks run.

        The tree depends on the number of tasks alone: neighbours are combined, then their pairs, and so on. On a cluster no worker and not
        this process hold more than a few values at a time. The error of a task is raised here.
        """
        return combined_groups(self.values(function, chain.from_iterable(groups), *common), groups, combine)

    @abstractmethod
    def close(self) -> None:
        """End the workers that were started for this object, and the connections to others."""
