"""Tasks of a benchmark over seeds, one process a core."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from flexcal.parallel import open_workers

V = TypeVar("V")


def in_parallel(
    function: Callable[..., V],
    tasks: Sequence[Any],
    *common: Any,
    processes: int | None = None,
    show: Callable[[V], object] | None = None,
) -> list[V]:
    """`function(task, *common)` of all tasks in their order, each shown as it ends; the first that fails ends the benchmark."""
    values: dict[int, V] = {}
    with open_workers(None, processes or os.cpu_count() or 1) as workers:
        for outcome in workers.results(function, tasks, *common):
            if outcome.error is not None or outcome.value is None:
                raise SystemExit(f"task {tasks[outcome.index]}: {outcome.error}")
            values[outcome.index] = outcome.value
            if show is not None:
                print(show(outcome.value), flush=True)
    return [values[index] for index in range(len(tasks))]
