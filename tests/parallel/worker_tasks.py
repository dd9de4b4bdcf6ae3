"""Tasks that worker processes import."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np

from flexcal.errors import InputError


def least_squares(seed: int, rows: int) -> np.ndarray:
    """Solution of random equations."""
    rng = np.random.default_rng(seed)
    return np.linalg.lstsq(rng.standard_normal((rows, 6)), rng.standard_normal(rows), rcond=None)[0]


def failing(number: int) -> int:
    """The number; some are refused, each in another way."""
    if number == 2:
        raise InputError("E-CAL-900", "a.csv line 3: the loop was open; close it.")
    if number == 3:
        raise ValueError("no\nnumber")
    if number == 4:
        raise SystemExit(1)
    return number


def killing(number: int, folder: Path, deadly: int, times: int) -> int:
    """The number; the task `deadly` first kills its worker, so many times. Every try leaves a file."""
    tries = len(list(folder.glob(f"{number}_*")))
    (folder / f"{number}_{tries}").touch()
    if number == deadly and tries < times:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def letter(number: int) -> str:
    """A letter for each number."""
    return "abcdefghijklmnop"[number]


def paired(left: str, right: str) -> str:
    """Both in brackets, which show the tree."""
    return f"({left}{right})"


def process(number: int) -> set[int]:
    """The process that the task ran in, after a while."""
    time.sleep(2.0)
    return {os.getpid()}


def unpaired(left: str, right: str) -> str:
    """No value."""
    raise InputError("E-CAL-901", f"{left} and {right} do not go together; part them.")
