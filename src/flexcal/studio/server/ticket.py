"""An address that opens the window once."""

from __future__ import annotations

import secrets
import threading
import time

_LASTS = 120.0
"""Seconds, in which a browser has started."""


class Ticket:
    """A code that is good for one request, soon: programs that are started with an address show it to all users of a machine."""

    def __init__(self) -> None:
        self.code = secrets.token_urlsafe(32)
        self._spent = threading.Lock()
        self._until = time.monotonic() + _LASTS

    def spend(self) -> bool:
        """Whether it was still good."""
        return self._spent.acquire(blocking=False) and time.monotonic() < self._until
