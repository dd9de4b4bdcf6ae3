"""Atomic writing of files: written under a temporary name, then renamed."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flexcal.errors import InputError


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary file beside `path` that takes its place when the block ends and goes when it raises.

    Raises `InputError` where the folder does not exist and cannot be made, or cannot be written to.
    """
    with atomic_paths(path) as (temporary,):
        yield temporary


@contextmanager
def atomic_paths(*paths: str | Path) -> Iterator[tuple[Path, ...]]:
    """`atomic_path` for files that belong together: all of them are whole before the first takes its place."""
    places = [Path(path) for path in paths]
    temporaries: list[Path] = []
    try:
        for place in places:
            temporaries.append(_temporary(place))
        yield tuple(temporaries)
        for place, temporary in zip(places, temporaries, strict=True):
            temporary.chmod(_mode_of(place))
            with temporary.open("rb") as stream:
                os.fsync(stream.fileno())
        for place, temporary in zip(places, temporaries, strict=True):
            temporary.replace(place)
    except OSError as problem:
        named = " and ".join(str(place) for place in places)
        raise InputError(f"{named} could not be written ({_reason(problem)}).") from problem
    finally:
        for temporary in temporaries:
            temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write UTF-8 text with newlines as given, atomically."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(text.encode("utf-8"))


def _temporary(path: Path) -> Path:
    """An empty file beside `path`, in a folder that is made where it is not there."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise InputError(f"{path} is a folder, so no file can be written there; give another name.")
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=f".tmp{path.suffix}")
    except OSError as problem:
        raise InputError(
            f"{path} cannot be written ({_reason(problem)}); choose a folder that can."
        ) from problem
    os.close(handle)
    return Path(name)


def _mode_of(path: Path) -> int:
    """The permissions of the file being replaced, else those that a new file would get."""
    if path.exists():
        return path.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def _reason(problem: OSError) -> str:
    return problem.strerror or str(problem)
