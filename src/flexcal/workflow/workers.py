"""Work of other processes, which ends with the process that asked for it."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

_EVERY = 0.5
"""s between two looks at whether the parent is alive."""
_watched = threading.Lock()


@dataclass(frozen=True)
class WorkerTask(Generic[P, T]):
    """`function`, to be called in a worker process; that ends within a second when the process that started it does, even by a kill."""

    function: Callable[P, T]
    _asked_by: int = field(default_factory=os.getpid)

    def __call__(self, *arguments: P.args, **options: P.kwargs) -> T:
        if os.getpid() != self._asked_by and _watched.acquire(blocking=False):  # once in a process
            threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
        return self.function(*arguments, **options)


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_EVERY)
    os._exit(1)
