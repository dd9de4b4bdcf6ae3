"""Atomic writing of files: written elsewhere on the same file system, then renamed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction.publication import FileTransaction


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
    """`atomic_path` for files that belong together: they take their places together."""
    running = FileTransaction.running()
    if running is not None:
        with _written(running, [Path(path) for path in paths]) as temporaries:
            yield temporaries
        return
    alone = FileTransaction()  # no other thread's files wait for these
    try:
        with _written(alone, [Path(path) for path in paths]) as temporaries:
            yield temporaries
        alone.publish()
    finally:
        alone.discard()


@contextmanager
def _written(publication: FileTransaction, places: list[Path]) -> Iterator[tuple[Path, ...]]:
    temporaries: list[Path] = []
    try:
        for place in places:
            temporaries.append(_temporary(publication, place))
        yield tuple(temporaries)
        for place, temporary in zip(places, temporaries, strict=True):
            publication.put(place, temporary)
    except OSError as problem:
        named = " and ".join(str(place) for place in places)
        raise InputError(
            "E-FILE-011", f"{named} could not be written ({_reason(problem)}); nothing there was changed."
        ) from problem
    finally:
        publication.drop(temporaries)


def write_text(path: str | Path, text: str | Iterator[str]) -> None:
    """Write UTF-8 text, whole or in parts, with newlines as given, atomically; bytes of a file name that are not UTF-8 as \\udc and hex."""
    parts = (text,) if isinstance(text, str) else text
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        stream.writelines(part.encode("utf-8", "backslashreplace") for part in parts)


def _temporary(publication: FileTransaction, path: Path) -> Path:
    try:
        return publication.temporary(path)
    except OSError as problem:
        raise InputError(
            "E-FILE-012", f"{path} cannot be written ({_reason(problem)}); choose a folder that can."
        ) from problem


def _reason(problem: OSError) -> str:
    return problem.strerror or str(problem)
