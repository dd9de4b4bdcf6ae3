"""Worker processes, which end with the process that asked for them, and are quiet at Ctrl-C."""

from __future__ import annotations

import os
import signal
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


def start_workers(jobs: int) -> None:
    """Start so many worker processes of joblib, which leave Ctrl-C to this process: it comes to all processes of a terminal at once."""
    from multiprocessing import resource_tracker

    from joblib import Parallel, delayed
    from joblib.externals.loky.backend import resource_tracker as loky_tracker

    for tracker in (resource_tracker, loky_tracker):  # their start would let signals through again
        tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # which is handed down
    try:
        Parallel(n_jobs=jobs)(delayed(WorkerTask(int))() for _ in range(jobs))
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_EVERY)
    os._exit(1)
