"""Folder in which the files of one run wait."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from flexcal.files.transaction.locks import lock_file, locked

PREFIX = ".flexcal-run-"
_OWNER = "owner"


@dataclass
class Stage:
    """A hidden folder in `folder`, on the same file system, so that a file takes its place there by being renamed.

    Its file `owner` says which verb of which process writes which names (glob patterns) in `folder`, and is locked as long as it lives.
    """

    folder: Path
    path: Path
    _handle: int
    _files: int = 0

    @classmethod
    def open(cls, folder: Path, verb: str, names: Sequence[str]) -> Stage:
        """Raises `OSError` where the folder cannot be written to."""
        with locked(folder):
            path = Path(tempfile.mkdtemp(prefix=PREFIX, dir=folder))
            try:
                text = "\n".join([verb, str(os.getpid()), *names])
                (path / _OWNER).write_bytes(os.fsencode(text))
                handle = lock_file(path / _OWNER)
            except BaseException:
                remove_stage(path)
                raise
        return cls(folder, path, -1 if handle is None else handle)

    def file(self, suffix: str) -> Path:
        """A new empty file in it, with this ending."""
        self._files += 1
        path = self.path / f"{self._files}{suffix}"
        path.touch(mode=0o600, exist_ok=False)
        return path

    def remove(self) -> None:
        """Remove it with all that waits in it."""
        remove_stage(self.path)
        self.release()

    def release(self) -> None:
        """Give up its lock, as the end of the process does."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1


@dataclass(frozen=True)
class StageOwner:
    """The run that a stage belongs to."""

    verb: str
    process: str
    names: tuple[str, ...]


def stages_in(folder: Path) -> list[Path]:
    """The stages in a folder; none where it cannot be read."""
    try:
        with os.scandir(folder) as entries:
            return [
                Path(entry.path)
                for entry in entries
                if entry.name.startswith(PREFIX) and entry.is_dir(follow_symlinks=False)
            ]
    except OSError:
        return []


def owner_of(stage: Path) -> StageOwner | None:
    """None where the stage has gone, or is none."""
    try:
        verb, process, *names = os.fsdecode((stage / _OWNER).read_bytes()).split("\n")
    except (OSError, ValueError):
        return None
    return StageOwner(verb, process, tuple(names))


def remove_stage(stage: Path) -> None:
    """Remove as much of it as can be, its owner last: what is left is known for a stage."""
    with suppress(OSError):
        for path in stage.iterdir():
            if path.name != _OWNER:
                path.unlink()
        (stage / _OWNER).unlink(missing_ok=True)
        stage.rmdir()


def lock_orphan(stage: Path) -> int | None:
    """The handle that locks a stage whose process has ended; None of one that is alive, has gone, or is none."""
    return lock_file(stage / _OWNER)


def living_owner(stage: Path) -> StageOwner | None:
    """The run of a stage whose process is alive, else None."""
    handle = lock_orphan(stage)
    if handle is None:
        return owner_of(stage)
    os.close(handle)
    return None


def age(stage: Path) -> tuple[int, str]:
    """Orders the stages of a folder by when they were made."""
    try:
        return (stage / _OWNER).stat().st_mtime_ns, stage.name
    except OSError:
        return time.time_ns(), stage.name
