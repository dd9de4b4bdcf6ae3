"""Folder for intermediate files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Temporary folder of the system, removed at the end; that of a killed run stays until the system clears it."""
    with TemporaryDirectory(prefix="flexcal_scratch_", ignore_cleanup_errors=True) as name:
        yield Path(name)
