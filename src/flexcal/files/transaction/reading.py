"""Reading of files: the one place where a file is opened to be read, regular files of bounded size only."""

from __future__ import annotations

import os
import stat
from io import BufferedReader
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction.file_kinds import refuse_stream
from flexcal.files.transaction.file_transaction import current_path

MEGABYTE = 10**6
_LEAST_UNPACKED, _MOST_PACKED = 120 * MEGABYTE, 100
LARGEST = 64 * MEGABYTE
"""Bytes of a file that is read whole, where its reader does not say another bound."""


def open_regular(path: str | Path, *, limit: int | None) -> BufferedReader:
    """Open a regular file to be read; of a running transaction the file that waits for this place.

    Opening never waits, as that of a pipe does. `limit` bounds its size in bytes; None is for what is read as a stream, in constant
    memory. Raises `InputError` where it is a pipe, socket or device, or larger, and `OSError` as `open` does.
    """
    place = current_path(path)
    flags = ("O_NONBLOCK", "O_CLOEXEC", "O_BINARY")
    handle = os.open(place, os.O_RDONLY | sum(getattr(os, flag, 0) for flag in flags))
    try:
        status = os.fstat(handle)
        if not stat.S_ISDIR(status.st_mode):  # of a folder `fdopen` raises IsADirectoryError
            _require_readable(path, place, status, limit)
        return os.fdopen(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def real_path(path: str | Path) -> Path:
    """Absolute path without links; where these form a loop, `Path.resolve` raises, and here the path stays as it is."""
    return Path(os.path.realpath(path))


def regular_path(path: str | Path, *, limit: int | None) -> Path:
    """Path of a regular file, for a library that opens it by its name; checked, and raises, as `open_regular` does."""
    place = current_path(path)
    status = os.stat(place)
    if not str(place).isprintable() and "\udc80" <= max(str(place)) <= "\udcff":
        raise InputError(
            "E-FILE-031",
            f"{path} has a name that is no UTF-8 text, as the library needs that reads it; rename it.",
        )
    if not stat.S_ISDIR(status.st_mode):
        _require_readable(path, place, status, limit)
    return place


def read_bytes(path: str | Path, *, limit: int = LARGEST) -> bytes:
    """Content of a regular file; raises as `open_regular` does, also where it grows beyond `limit` bytes while it is read."""
    content = bytearray()
    with open_regular(path, limit=limit) as stream:
        while len(content) <= limit and (more := stream.read(2**20)):
            content += more
    if len(content) > limit:
        raise InputError(
            "E-FILE-021", f"{path} grew beyond {size_text(limit)} while it was read; run it again."
        )
    return bytes(content)


def read_text(
    path: str | Path, *, encoding: str = "utf-8", errors: str = "strict", limit: int = LARGEST
) -> str:
    """Text of a regular file, with newlines as `\\n`; raises as `read_bytes` does, and `UnicodeDecodeError`."""
    text = read_bytes(path, limit=limit).decode(encoding, errors)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def unpacked_limit(packed: int, largest: int) -> int:
    """Largest size of what a file of `packed` bytes unpacks to: `largest`, or less where measurements cannot be packed as small."""
    return min(largest, max(_LEAST_UNPACKED, _MOST_PACKED * packed))


def size_text(size: int) -> str:
    """Size of a file in MB or GB."""
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / MEGABYTE:.3g} MB"


def _require_readable(path: str | Path, place: Path, status: os.stat_result, limit: int | None) -> None:
    if not stat.S_ISREG(status.st_mode):
        refuse_stream(place)
    if limit is not None and status.st_size > limit:
        raise InputError(
            "E-FILE-020",
            f"{path} has {size_text(status.st_size)}, and such a file is read up to {size_text(limit)}; "
            "check that it is the right one.",
        )
