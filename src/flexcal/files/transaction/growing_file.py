"""Files of lines that grow: appended line by line, so that a run that is cut off loses its last line at most."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from io import BufferedReader
from pathlib import Path

from flexcal.files.transaction.file_kinds import refuse_irregular
from flexcal.files.transaction.reading import open_regular

_BLOCK = 2**16


def append_lines(path: Path, lines: Iterable[str], *, synchronised: bool = True) -> None:
    """Append lines, whole or not at all, to a file that is made where it is not there; a torn last line is dropped before.

    Raises `InputError` where something stands in the place that is no regular file, and `OSError`.
    """
    refuse_irregular(path)
    content = "".join(f"{line}\n" for line in lines).encode("utf-8", "surrogateescape")
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    with os.fdopen(os.open(path, flags, 0o666), "r+b", buffering=0) as stream:
        end = _end_of_lines(stream.fileno())
        try:
            stream.truncate(end)
            stream.seek(end)
            written = 0
            while written < len(content):
                written += stream.write(content[written:])
            if synchronised:
                os.fsync(stream.fileno())
        except OSError:
            stream.truncate(end)
            raise


def whole_lines(path: Path) -> Iterator[str]:
    """Lines of a file, without a torn last one; none where there is no file. Raises `OSError` and `UnicodeDecodeError`."""
    try:
        stream = open_regular(path, limit=None)
    except FileNotFoundError:
        return
    with BufferedReader(stream) as buffered:
        for line in buffered:
            if line.endswith(b"\n"):
                yield line[:-1].decode("utf-8", "surrogateescape")


def _end_of_lines(handle: int) -> int:
    """Bytes up to the end of the last whole line."""
    at = os.fstat(handle).st_size
    while at > 0:
        start = max(at - _BLOCK, 0)
        os.lseek(handle, start, os.SEEK_SET)
        found = os.read(handle, at - start).rfind(b"\n")
        if found >= 0:
            return start + found + 1
        at = start
    return 0
