"""Postponement of signals."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_POSTPONED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Within the block, exceptions that handlers of Ctrl-C and other signals would raise wait until its end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    handlers = {number: signal.getsignal(number) for number in _POSTPONED}
    postponed = [number for number, handler in handlers.items() if callable(handler)]
    for number in postponed:
        signal.signal(number, lambda which, _frame: came.append(which))
    try:
        yield
    finally:
        for number in postponed:
            signal.signal(number, handlers[number])
        if came:
            signal.raise_signal(came[0])
