"""Signals that ask the program to stop: Ctrl-C, SIGTERM and SIGHUP."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

_IMPATIENT = 0.5
"""s after a first signal, when another one is no echo of it."""


@dataclass
class StopSignal:
    """The signal that came, None before."""

    number: int | None = None
    _since: float = 0.0
    _raises: bool = False

    @property
    def status(self) -> int:
        """The exit status, as shells have it of a program that a signal ends."""
        return 128 + (self.number or 0)

    @property
    def sentence(self) -> str:
        """What is said of it."""
        what = "interrupted" if self.number == signal.SIGINT else "stopped by a signal"
        return f"{what}; every file is as before, or whole as this run wrote it."

    def begin(self) -> None:
        """From here on a signal raises `KeyboardInterrupt`; at once where it came before."""
        self._raises = True
        if self.number is not None:
            raise KeyboardInterrupt

    def end(self) -> None:
        """From here on a signal raises nothing."""
        self._raises = False

    def ask(self, number: int, _frame: FrameType | None) -> None:
        """Raise `KeyboardInterrupt`; end the process at once where that was asked for before."""
        now = time.monotonic()
        if self.number is None:
            self.number, self._since = number, now
            if self._raises:
                raise KeyboardInterrupt
        elif now - self._since > _IMPATIENT:
            os._exit(128 + number)


@contextmanager
def noted_stop_signals() -> Iterator[StopSignal]:
    """Within the block, these signals are noted, but those that were ignored from the start (nohup) stay so."""
    stopping = StopSignal()
    before: dict[int, object] = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                before[number] = signal.signal(number, stopping.ask)
    try:
        yield stopping
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
