"""Journal of a publication, written before it begins so that any process can finish it."""

from __future__ import annotations

import errno
import json
import os
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import InputError

Seen = tuple[int, int] | None
"""Size and time of the last change, ns, of a file; None without a file."""
_NAME = "journal.json"
_PRIMARY = "primary"


@dataclass(frozen=True)
class Change:
    """Replacement of `place`, unchanged since `seen`, by the file `staged`; None removes it."""

    staged: Path | None
    place: Path
    seen: Seen


@dataclass(frozen=True)
class Journal:
    """The changes, in their order, and the stages to remove afterwards, that of the journal last.

    A journal counts from the moment when it lies in the last stage: before, nothing has changed; after, everything will. The other stages
    have a note of where it is.
    """

    changes: tuple[Change, ...]
    stages: tuple[Path, ...]

    def write(self) -> None:
        """Write the journal to the last stage, synchronised to disk."""
        home = self.stages[-1]
        for stage in self.stages[:-1]:
            write_through(stage / _PRIMARY, os.fsencode(os.path.relpath(home, stage)))
            sync_folder(stage)
        document = {
            "changes": [
                [
                    None if c.staged is None else os.path.relpath(c.staged, home),
                    os.path.relpath(c.place, home),
                    c.seen,
                ]
                for c in self.changes
            ],
            "stages": [os.path.relpath(stage, home) for stage in self.stages],
        }
        half = home / f"{_NAME}.half"
        write_through(half, json.dumps(document).encode("ascii"))
        sync_folder(home)
        half.replace(home / _NAME)
        sync_folder(home)

    def carry_out(self) -> None:
        """Make the remaining changes; raises `InputError` for places changed meanwhile by others, and `OSError`."""
        for change in self.changes:
            if change.staged is None:
                if change.seen is not None and seen(change.place) == change.seen:
                    change.place.unlink(missing_ok=True)
            elif change.staged.exists():
                if seen(change.place) != change.seen:
                    raise InputError(
                        "E-FILE-015",
                        f"{change.place} was changed after a run that was replacing it had been cut off; move it away, so that the next "
                        f"command can finish with {change.staged.parent}, or remove that folder.",
                    )
                change.staged.replace(change.place)
        for folder in {change.place.parent for change in self.changes}:
            sync_folder(folder)


def read_journal(stage: Path) -> Journal | None:
    """The journal in a stage, None where there is none."""
    try:
        document = json.loads((stage / _NAME).read_bytes())
    except FileNotFoundError:
        return None
    changes = tuple(
        Change(
            None if staged is None else _from(stage, staged),
            _from(stage, place),
            None if was is None else (was[0], was[1]),
        )
        for staged, place, was in document["changes"]
    )
    return Journal(changes, tuple(_from(stage, other) for other in document["stages"]))


def primary_of(stage: Path) -> Path | None:
    """The stage that has the journal for this one too, None where this one stands alone."""
    try:
        return _from(stage, os.fsdecode((stage / _PRIMARY).read_bytes()))
    except OSError:
        return None


def seen(place: Path) -> Seen:
    """State of a file that changes whenever it is written anew."""
    try:
        status = place.lstat()
    except FileNotFoundError:
        return None
    return status.st_size, status.st_mtime_ns


def write_through(path: Path, content: bytes) -> None:
    """Write a file, synchronised to disk."""
    with path.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


def sync_folder(folder: Path) -> None:
    """Synchronise the names in a folder to disk."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    except OSError as problem:
        if problem.errno not in (errno.EINVAL, errno.ENOTSUP):  # file systems that do it by themselves
            raise
    finally:
        os.close(handle)


def _from(stage: Path, relative: str) -> Path:
    return Path(os.path.normpath(stage / relative))
