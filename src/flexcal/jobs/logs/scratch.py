"""Folder for intermediate files."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from flexcal.files.transaction import lock_file

_PREFIX = "flexcal_scratch_"
_OWNER = "owner"


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Temporary folder of the system, removed at the end; those of killed runs are removed first."""
    _remove_orphans(Path(tempfile.gettempdir()))
    with tempfile.TemporaryDirectory(prefix=_PREFIX, ignore_cleanup_errors=True) as name:
        folder = Path(name)
        # locked before it has its name, by which others would take it for an orphan's
        (folder / f"{_OWNER}.new").touch()
        handle = lock_file(folder / f"{_OWNER}.new")
        (folder / f"{_OWNER}.new").rename(folder / _OWNER)
        try:
            yield folder
        finally:
            if handle is not None:
                os.close(handle)


def _remove_orphans(place: Path) -> None:
    for folder in place.glob(f"{_PREFIX}*"):
        with suppress(OSError):
            if folder.stat().st_uid != os.getuid():
                continue
            handle = lock_file(folder / _OWNER)
            if handle is not None:
                shutil.rmtree(folder, ignore_errors=True)
                os.close(handle)
