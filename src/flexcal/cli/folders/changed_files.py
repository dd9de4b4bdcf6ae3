"""Errors in showing the files of a folder: flexcal's own bugs where it wrote them, one sentence where they were changed since."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flexcal.errors import FlexcalError, InputError
from flexcal.files.transaction import Ledger, digest_on_disk

_OF_OTHER_CONTENT = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError)
"""What showing a document raises whose keys and values are of other kinds than flexcal writes."""


@contextmanager
def stored_files(*folders: Path) -> Iterator[None]:
    """Around the making of a page from the files of `folders`: an error becomes an `InputError` that names the file which is not as
    flexcal wrote it, by its SHA-256 in the folder's ledger, or, without a ledger, the folder. Of unchanged files it stays: it is a bug."""
    from jinja2 import UndefinedError

    try:
        yield
    except InputError:
        raise
    except (FlexcalError, *_OF_OTHER_CONTENT, UndefinedError) as problem:
        changed = next((path for folder in folders for path in _changed(folder)), None)
        if changed is None:
            raise
        what = f"{type(problem).__name__}: {problem}"
        raise InputError(
            "E-CLI-009",
            f"{changed} is not as flexcal wrote it, and cannot be shown ({what[:200]}); run the verb that writes it again.",
        ) from problem


def _changed(folder: Path) -> Iterator[Path]:
    """The files of a folder that are not as flexcal wrote them; the folder where it is not known what that wrote."""
    written = {name: digest for name, (digest, _) in Ledger.read(folder).entries.items()}
    if not written:
        yield folder
    for name, digest in written.items():
        path = folder / name
        if path.is_file() and digest_on_disk(path) != digest:
            yield path
