"""Worker processes that end with their parent process and ignore Ctrl-C, and signals that wait while such processes start or end."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_EVERY = 0.5
"""Seconds between two checks that the parent is alive."""
_STOPPING = ("SIGINT", "SIGTERM", "SIGHUP")
"""Names of the signals that ask a program to stop, where the system has them."""


def end_with(parent: int) -> None:
    """Let this worker process end within a second of its parent process, even if that is killed."""
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_EVERY)
    os._exit(1)


@contextmanager
def signals_wait() -> Iterator[None]:
    """Within the block, handlers of signals that ask this process to stop are not called, but at its end.

    A pool of processes that is half started, or half ended, by an exception from a handler would wait for ever. Processes that are started
    within the block ignore Ctrl-C.
    """
    from multiprocessing import resource_tracker

    from joblib.externals.loky.backend import resource_tracker as loky_tracker

    came: list[tuple[int, FrameType | None]] = []
    handlers = {}
    if threading.current_thread() is threading.main_thread():
        for number in (getattr(signal, name) for name in _STOPPING if hasattr(signal, name)):
            if callable(handler := signal.getsignal(number)):
                handlers[number] = handler
                signal.signal(number, lambda number, frame: came.append((number, frame)))
    for tracker in (resource_tracker, loky_tracker):  # their start would let signals through again
        tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # which is handed down
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number, frame in came:
            handlers[number](number, frame)
