"""Reading of files: the one place where a file is opened to be read, regular files of bounded size only."""

from __future__ import annotations

import os
import stat
from io import FileIO
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction.file_kinds import refuse_stream
from flexcal.files.transaction.publication import current_path

MEGABYTE = 10**6
LARGEST = 64 * MEGABYTE
"""Bytes of a file that is read whole, where its reader does not say another bound."""


def open_regular(path: str | Path, *, limit: int | None) -> FileIO:
    """Open a regular file to be read, unbuffered; of a running transaction the file that waits for this place.

    Opening never waits, as that of a pipe does. `limit` bounds its size in bytes; None is for what is read as a stream, in constant
    memory. Raises `InputError` where it is a pipe, socket or device, or larger, and `OSError` as `open` does.
    """
    place = current_path(path)
    handle = os.open(
        place,
        os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0),
    )
    stream = FileIO(handle, "rb")  # of a folder this raises IsADirectoryError
    try:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode):
            refuse_stream(place)
        if limit is not None and status.st_size > limit:
            raise InputError(
                "E-FILE-020",
                f"{path} has {_megabytes(status.st_size)}, and such a file is read up to {_megabytes(limit)}; "
                "check that it is the right one.",
            )
    except BaseException:
        stream.close()
        raise
    return stream


def read_bytes(path: str | Path, *, limit: int = LARGEST) -> bytes:
    """Content of a regular file; raises as `open_regular` does, also where it grows beyond `limit` bytes while it is read."""
    content = bytearray()
    with open_regular(path, limit=limit) as stream:
        while len(content) <= limit and (more := stream.read(2**20)):
            content += more
    if len(content) > limit:
        raise InputError(
            "E-FILE-021", f"{path} grew beyond {_megabytes(limit)} while it was read; run it again."
        )
    return bytes(content)


def read_text(
    path: str | Path, *, encoding: str = "utf-8", errors: str = "strict", limit: int = LARGEST
) -> str:
    """Text of a regular file, with newlines as `\\n`; raises as `read_bytes` does, and `UnicodeDecodeError`."""
    text = read_bytes(path, limit=limit).decode(encoding, errors)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _megabytes(size: int) -> str:
    return f"{size / MEGABYTE:.3g} MB"
