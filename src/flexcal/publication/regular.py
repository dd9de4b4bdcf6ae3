"""What may be replaced by a file."""

from __future__ import annotations

import stat
from pathlib import Path

from flexcal.errors import InputError

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISLNK, "a link"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def refuse_irregular(path: Path) -> None:
    """Raise `InputError` where a folder, link, pipe, socket or device stands in the place of a file; `OSError` where nobody can tell."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    for holds, kind in _KINDS:
        if holds(mode):
            raise InputError(f"{path} is {kind}, which is not replaced by a file; give another name.")
