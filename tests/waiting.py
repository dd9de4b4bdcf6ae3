"""Waiting for what other processes and threads do."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

PATIENCE = 300.0
"""s; a wait ends with its condition, and this long only where something is wrong, on a machine however slow."""


def until(condition: Callable[[], Any]) -> None:
    """Wait for a condition; fails after `PATIENCE`."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)
