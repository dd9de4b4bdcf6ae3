"""Checks of the file types that may be read or replaced."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from flexcal.errors import InputError

_STREAMS = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
_KINDS = ((stat.S_ISDIR, "a folder"), (stat.S_ISLNK, "a link"), *_STREAMS)


def refuse_irregular(path: Path) -> None:
    """Raise `InputError` where a folder, link, pipe, socket or device stands in the place of a file; `OSError` where nobody can tell."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    for holds, kind in _KINDS:
        if holds(mode):
            raise InputError(
                "E-FILE-013", f"{path} is {kind}, which is not replaced by a file; give another name."
            )


def refuse_stream(path: Path) -> None:
    """Raise `InputError` where a pipe, socket or device, or a link to one, stands in the place of a file to be read.

    Reading it may wait for ever or have no end, and what came out of it cannot be read again for a SHA-256.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):  # the reader says what is wrong
        return
    for holds, kind in _STREAMS:
        if holds(mode):
            raise InputError(
                "E-FILE-014", f"{path} is {kind}, not a file; write its content to a file, and name that."
            )


def refuse_linked_folder(path: Path, root: Path) -> None:
    """Raise `InputError` where a folder between `root`, which is not looked at, and a file below it is a link."""
    top, folder = Path(os.path.abspath(root)), Path(os.path.abspath(path)).parent
    for between in (folder, *folder.parents) if top in folder.parents else ():
        if between == top:
            return
        if between.is_symlink():
            raise InputError(
                "E-FILE-029",
                f"{between} is a link, behind which nothing is written; replace it by a folder, or give another name.",
            )
