"""Worker processes that end with their parent process and ignore Ctrl-C."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Generic, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

_EVERY = 0.5
"""Seconds between two checks that the parent is alive."""
_watched = threading.Lock()


@dataclass(frozen=True)
class WorkerTask(Generic[P, T]):
    """Function to be called in a worker process, which ends within a second of its parent, even if that is killed."""

    function: Callable[P, T]
    _asked_by: int = field(default_factory=os.getpid)

    def __call__(self, *arguments: P.args, **options: P.kwargs) -> T:
        if os.getpid() != self._asked_by and _watched.acquire(blocking=False):  # once in a process
            threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
        return self.function(*arguments, **options)


@contextmanager
def interrupts_left_to_this_process() -> Iterator[None]:
    """Within the block, processes are started that ignore Ctrl-C."""
    from multiprocessing import resource_tracker

    from joblib.externals.loky.backend import resource_tracker as loky_tracker

    for tracker in (resource_tracker, loky_tracker):  # their start would let signals through again
        tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # which is handed down
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_EVERY)
    os._exit(1)
