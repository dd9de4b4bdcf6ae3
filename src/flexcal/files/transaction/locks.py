"""Locks between runs, in the user's own cache folder: no lock is a file in the folder that it protects."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from flexcal.errors import InputError

if TYPE_CHECKING:
    from filelock import BaseFileLock

_PATIENCE = 60.0
"""Seconds to wait for another run that writes the same file."""


@contextmanager
def locked(place: Path) -> Iterator[None]:
    """Hold a file or folder while it is written, waiting for other processes; without a lock where the cache folder cannot be written.

    Raises `InputError` where another process holds it for a minute.
    """
    try:
        lock = _acquired(place, "write", _PATIENCE)
    except TimeoutError as problem:
        raise InputError(
            "E-FILE-027",
            f"another flexcal has been writing {place} for {_PATIENCE:.0f} s; wait for its end, or end it.",
        ) from problem
    try:
        yield
    finally:
        if lock is not None:
            lock.release()


@contextmanager
def sole_holder(place: Path, purpose: str, holder: str) -> Iterator[str | None]:
    """Hold a file or folder for a purpose until the block or the process ends, known as `holder`, and yield None.

    Where another process holds it, nothing is held, and the name of that process is yielded.
    """
    try:
        lock = _acquired(place, purpose, 0)
    except TimeoutError:
        try:
            yield _note(place, purpose).read_text("utf-8")
        except OSError:
            yield "another flexcal"
        return
    try:
        if lock is not None:
            with suppress(OSError):
                _note(place, purpose).write_text(holder, "utf-8")
        yield None
    finally:
        if lock is not None:
            lock.release()


def _acquired(place: Path, purpose: str, seconds: float) -> BaseFileLock | None:
    """The lock, held; None where there can be none. Raises `TimeoutError` where it is another's."""
    from filelock import FileLock

    path = _path(place, purpose)
    lock = FileLock(path, thread_local=False)
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        lock.acquire(timeout=seconds)
    except TimeoutError:
        raise
    except (OSError, NotImplementedError):  # a home that cannot be written, a file system without locks
        return None
    return lock


def _path(place: Path, purpose: str) -> Path:
    from hashlib import sha256

    from platformdirs import user_cache_path

    name = sha256(os.fsencode(f"{purpose} {os.path.realpath(place)}")).hexdigest()[:32]
    return user_cache_path("flexcal", appauthor=False) / "locks" / f"{name}.lock"


def _note(place: Path, purpose: str) -> Path:
    return _path(place, purpose).with_suffix(".holder")
