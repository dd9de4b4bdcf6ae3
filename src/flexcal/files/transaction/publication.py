"""Transaction of the files of one run, which are put in place together."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import TracebackType

from flexcal.errors import InputError
from flexcal.files.transaction.file_kinds import refuse_irregular, refuse_stream
from flexcal.files.transaction.journal import Change, Journal, Seen, seen, sync_folder
from flexcal.files.transaction.locks import locked
from flexcal.files.transaction.recovery import recover
from flexcal.files.transaction.staging_folder import Stage

_POSTPONED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def deferred_signals() -> Iterator[None]:
    """Defer exceptions raised by handlers of Ctrl-C and other signals to the end of the block."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    handlers = {number: signal.getsignal(number) for number in _POSTPONED}
    postponed = [number for number, handler in handlers.items() if callable(handler)]
    for number in postponed:
        signal.signal(number, lambda which, _frame: came.append(which))
    try:
        yield
    finally:
        for number in postponed:
            signal.signal(number, handlers[number])
        if came:
            signal.raise_signal(came[0])


_open: list[FileTransaction] = []
"""Running transactions, the innermost last; of the whole process, as files are."""


class FileTransaction:
    """Files written within its block wait in stages, hidden folders beside their places, and take these together when the block ends.

    When it raises, nothing has changed. When the process is killed, the places hold the files of before or, once the journal is on the
    disk, the next flexcal that opens the folder puts all of the new ones there. `current_path` leads to a file that waits.
    """

    def __init__(self) -> None:
        self._stages: dict[Path, Stage] = {}
        self._made: list[Path] = []
        self._waiting: dict[Path, Path] = {}
        self._before: dict[Path, Seen] = {}
        self._removed: dict[Path, Seen] = {}
        self._done = False

    def __enter__(self) -> FileTransaction:
        _open.append(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None and not self._done:
                self.publish()
        finally:
            _open.remove(self)
            self.discard()

    @staticmethod
    def running() -> FileTransaction | None:
        """Innermost running transaction."""
        return _open[-1] if _open else None

    @property
    def files(self) -> dict[Path, Path]:
        """Staged files by their places."""
        return dict(self._waiting)

    def stage(self, folder: Path, verb: str = "", names: Sequence[str] = ()) -> Stage:
        """The stage in a folder, which is made where it is not there; for a `verb` that writes these names (glob patterns).

        Raises `OSError` where the folder cannot be made or written to, and `InputError` as `recover` does.
        """
        folder = Path(os.path.realpath(folder))
        if folder not in self._stages:
            recover(folder)
            with deferred_signals():
                self._made += [path for path in (folder, *folder.parents) if not path.exists()]
                folder.mkdir(parents=True, exist_ok=True)
                self._stages[folder] = Stage.open(folder, verb, names)
        return self._stages[folder]

    def temporary(self, path: Path) -> Path:
        """Empty temporary file for `path`, to be written in any order; `put` takes it when it is complete.

        Raises `InputError` where something stands in its place that is no regular file, and `OSError`.
        """
        place = _place(path)
        refuse_irregular(path)
        stage = self.stage(place.parent)
        self._before.setdefault(place, seen(place))
        return stage.file(place.suffix)

    def put(self, path: Path, temporary: Path) -> None:
        """Stage a complete file for its place, replacing one staged before. Raises `OSError`."""
        place = _place(path)
        temporary.chmod(_mode_of(place))
        with temporary.open("rb") as stream:
            os.fsync(stream.fileno())
        earlier = self._waiting.pop(place, None)
        self._waiting[place] = temporary
        if earlier is not None:
            earlier.unlink()

    def drop(self, temporaries: Iterable[Path]) -> None:
        """Remove those of these files that `put` has not taken."""
        taken = set(self._waiting.values())
        for temporary in temporaries:
            if temporary not in taken:
                temporary.unlink(missing_ok=True)

    def remove(self, path: Path) -> None:
        """Remove a file together with the changes."""
        place = _place(path)
        self._removed[place] = seen(place)

    def waiting(self, path: Path) -> Path | None:
        """Path of the staged file of this place, None without one."""
        return self._waiting.get(_place(path)) if self._waiting else None

    def publish(self, prepare: Callable[[], None] = lambda: None) -> None:
        """Put every file in its place; `prepare` comes just before, while no other run can change these folders.

        Files that `prepare` adds are put in place first. Raises `InputError` where a place was changed since its file was written, and
        where the files cannot be put there.
        """
        whole = False
        try:
            with deferred_signals():
                with ExitStack() as locks:
                    for folder in sorted(self._stages):
                        locks.enter_context(locked(folder))
                    waiting = list(self._waiting)
                    prepare()
                    order = [place for place in self._waiting if place not in waiting] + waiting
                    self._refuse_changed()
                    changes = [Change(self._waiting[place], place, self._before[place]) for place in order]
                    changes += [Change(None, place, was) for place, was in self._removed.items()]
                    for stage in self._stages.values():
                        sync_folder(stage.path)
                    if len(changes) > 1:
                        journal = Journal(
                            tuple(changes), tuple(stage.path for stage in self._stages.values())
                        )
                        journal.write()
                        whole = self._done = True
                        journal.carry_out()
                    elif changes:
                        Journal(tuple(changes), ()).carry_out()
                    self._done = True
                for stage in self._stages.values():
                    stage.remove()
        except OSError as problem:
            reason = problem.strerror or str(problem)
            folders = " and ".join(str(folder) for folder in self._stages)
            if whole:
                for stage in self._stages.values():
                    stage.release()
                raise InputError(
                    "E-FILE-016",
                    f"all files of this run are written, but could not be put in place in {folders} ({reason}); the next flexcal that "
                    "opens the folder does it.",
                ) from problem
            raise InputError(
                "E-FILE-017", f"{folders} could not be written to ({reason}); nothing there was changed."
            ) from problem

    def _refuse_changed(self) -> None:
        for place, was in self._before.items():
            if place in self._waiting and seen(place) != was:
                raise InputError(
                    "E-FILE-018",
                    f"{place} was changed by another program while this run was at work; nothing there was changed by this run; run it "
                    "again.",
                )

    def discard(self) -> None:
        """Drop the staged files, unless they have been published."""
        if self._done:
            return
        with deferred_signals():
            for stage in self._stages.values():
                stage.remove()
            for folder in self._made:
                with suppress(OSError):
                    folder.rmdir()


def current_path(path: str | Path) -> Path:
    """Path to read `path` from: the file staged for this place in the running transaction, else the path itself.

    Raises `InputError` where this is a pipe, socket or device.
    """
    running = FileTransaction.running()
    place = (running.waiting(Path(path)) if running else None) or Path(path)
    refuse_stream(place)
    return place


def _place(path: Path) -> Path:
    return Path(os.path.realpath(path.parent)) / path.name


def _mode_of(place: Path) -> int:
    """The permissions of the file being replaced, else those that a new file would get."""
    if place.exists():
        return place.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
