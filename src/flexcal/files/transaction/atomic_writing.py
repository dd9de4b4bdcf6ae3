"""Atomic writing of files: written beside their places under random names, then renamed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flexcal.files.transaction.file_transaction import FileTransaction


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary file that takes the place of `path` when the block ends, and goes when it raises.

    Within the block of a `FileTransaction` it waits for the end of that, and `current_path` leads to it. Raises `InputError` where the
    folder does not exist and cannot be made, or cannot be written to, and where `path` is there and no regular file.
    """
    with atomic_paths(path) as (temporary,):
        yield temporary


@contextmanager
def atomic_paths(*paths: str | Path) -> Iterator[tuple[Path, ...]]:
    """`atomic_path` for files that belong together: they take their places together, in this order."""
    with FileTransaction.joined() as run, run.writing(*map(Path, paths)) as temporaries:
        yield temporaries


def write_text(path: str | Path, text: str | Iterator[str]) -> None:
    """Write UTF-8 text, whole or in parts, with newlines as given, atomically; bytes of a file name that are not UTF-8 as \\udc and hex."""
    parts = (text,) if isinstance(text, str) else text
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        stream.writelines(part.encode("utf-8", "backslashreplace") for part in parts)
