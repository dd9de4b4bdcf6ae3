"""One studio a folder: two would each take the rows of a file that grows."""

from __future__ import annotations

import fcntl
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from flexcal.errors import InputError

_FILE = ".studio.lock"
"""Has the process; what counts is its lock, which ends with the process."""


@contextmanager
def sole_studio(folder: Path) -> Iterator[None]:
    """Hold a folder as its only studio until the block or the process ends, also where it is killed.

    Folders that cannot be written, and file systems without locks, are not held. Raises `InputError` where another studio holds it.
    """
    handle = _opened(folder / _FILE)
    if handle is None:
        yield
        return
    try:
        _hold(handle, folder.name)
        yield
    finally:
        os.close(handle)


def _hold(handle: int, name: str) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as problem:
        process = os.pread(handle, 20, 0).decode("ascii", "replace").strip() or "that just started"
        raise InputError(
            "E-STUDIO-043",
            f"another studio (process {process}) has {name} open; open its URL in a second window, or end it first.",
        ) from problem
    except OSError:
        return
    with suppress(OSError):
        os.ftruncate(handle, 0)
        os.pwrite(handle, f"{os.getpid()}\n".encode(), 0)


def _opened(path: Path) -> int | None:
    """Handle of the file; None where it cannot be made, and of a link or anything but a file of its own."""
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o600)
    except OSError:
        return None
    status = os.fstat(handle)
    if stat.S_ISREG(status.st_mode) and status.st_nlink == 1:
        return handle
    os.close(handle)
    return None
