"""Plans of the project, read once."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from flexcal.errors import FlexcalError

if TYPE_CHECKING:
    from flexcal.data.plans import Plan


def read_plan_file(path: Path) -> Plan | None:
    """A plan; None where the file is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return _read(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=64)
def _read(path: Path, changed: int, size: int) -> Plan | None:
    """The plan of a file; `changed` and `size` tell its versions apart."""
    from flexcal.data.plans import read_plan

    try:
        return read_plan(path)
    except FlexcalError:
        return None
