"""Transaction of the files of one run, which are put in place together."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from flexcal.errors import InputError
from flexcal.files.transaction.file_kinds import refuse_irregular, refuse_linked_folder, refuse_stream
from flexcal.files.transaction.locks import locked

TEMPORARY = ".flexcal-"
"""Names of files and folders that wait for their places begin with it; only the run that made them removes them, or a person."""
_POSTPONED = (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM))

Seen = tuple[int, int] | None
"""Size and time of the last change, ns, of a file; None without a file."""


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


@dataclass(frozen=True)
class Record:
    """File that says which files of a folder flexcal wrote: its content `during` the change of these, and `after` it."""

    place: Path
    during: bytes
    after: bytes


_open: list[FileTransaction] = []
"""Running transactions, the innermost last; of the whole process, as files are."""


class FileTransaction:
    """Files written within its block wait beside their places under random names, and take these when the block ends.

    When it raises, nothing has changed. A folder that is new appears whole. Where the process is killed while several files take their
    places, each of them is the former or the new one. `current_path` leads to a file that waits. Below a `root`, which the user has named,
    no link is followed.
    """

    def __init__(self, root: Path | None = None) -> None:
        self._root = root
        self._waiting: dict[Path, Path] = {}
        self._before: dict[Path, Seen] = {}
        self._removed: dict[Path, Seen] = {}
        self._new: dict[Path, Path] = {}
        self._made: list[Path] = []
        self._temporaries: set[Path] = set()
        self._held: set[Path] = set()
        self._locks = ExitStack()
        self._is_published = False

    def __enter__(self) -> FileTransaction:
        _open.append(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None and not self._is_published:
                self.publish()
        finally:
            _open.remove(self)
            self.discard()

    @staticmethod
    @contextmanager
    def joined() -> Iterator[FileTransaction]:
        """The running transaction, else one of its own for the block, in which no other thread's files wait."""
        if _open:
            yield _open[-1]
            return
        alone = FileTransaction()
        try:
            yield alone
            alone.publish()
        finally:
            alone.discard()

    @property
    def files(self) -> dict[Path, Path]:
        """Files that wait, by their places."""
        return dict(self._waiting)

    def is_new(self, folder: Path) -> bool:
        """Whether a folder is not there yet, and will appear with the files of this run."""
        return any(_is_in(Path(os.path.realpath(folder)), new) for new in self._new)

    def reserve(self, folder: Path) -> None:
        """Make sure that files can be written to a folder; raises `OSError` where they cannot."""
        home = self._home(Path(os.path.realpath(folder)))
        temporary = self._fresh(home, "")
        temporary.write_bytes(b"\n")
        self._drop(temporary)

    def hold(self, path: Path) -> None:
        """Keep other runs from writing a file until this one has ended, and note how it is now, before it is read."""
        place = _place(path)
        if not any(place in run._held for run in (*_open, self)):
            self._locks.enter_context(locked(place))
            self._held.add(place)
        self._before.setdefault(place, _seen(place))

    @contextmanager
    def writing(self, *paths: Path) -> Iterator[tuple[Path, ...]]:
        """Yield temporary files, empty, for these; they wait for their places when the block ends, and go when it raises.

        Raises `InputError` where something stands in the place that is no regular file, and where it cannot be written.
        """
        temporaries: list[Path] = []
        try:
            for path in paths:
                temporaries.append(self._temporary(path))
            yield tuple(temporaries)
            for path, temporary in zip(paths, temporaries, strict=True):
                self._put(path, temporary)
        except OSError as problem:
            named = " and ".join(str(path) for path in paths)
            raise InputError(
                "E-FILE-011", f"{named} could not be written ({_reason(problem)}); nothing there was changed."
            ) from problem
        finally:
            for temporary in temporaries:
                self._drop(temporary)

    def remove(self, path: Path) -> None:
        """Remove a file together with the changes."""
        self._refuse_link_to(path)
        place = _place(path)
        self._removed[place] = _seen(place)

    def waiting(self, path: Path) -> Path | None:
        """Path of the file that waits for this place, None without one."""
        return self._waiting.get(_place(path)) if self._waiting else None

    def publish(self, record: Record | None = None) -> None:
        """Put every file in its place, and that of the `record` before and after them.

        Raises `InputError` where a place was changed since its file was written, and where the files cannot be put there.
        """
        try:
            with deferred_signals():
                self._refuse_changed()
                if self._waiting or self._removed:
                    self._put_in_place(record)
                self._is_published = True
        finally:
            if self._is_published:
                self._waiting.clear()
                self._locks.close()

    def _put_in_place(self, record: Record | None) -> None:
        steps = self._steps(record)
        for done, (_, step) in enumerate(steps):
            try:
                step()
            except OSError as problem:
                raise self._not_in_place(done, len(steps), problem) from problem
        self._is_published = True
        for folder in {place.parent for place, _ in steps}:
            _sync_folder(folder)

    def _steps(self, record: Record | None) -> list[tuple[Path, Callable[[], object]]]:
        """What puts the files in place, step by step, each with the place that it changes."""
        steps: list[tuple[Path, Callable[[], object]]] = []
        try:
            record_steps = [] if record is None else self._record_steps(record)
        except OSError as problem:
            raise self._not_in_place(0, 0, problem) from problem
        for new, home in self._new.items():
            steps.append((new, lambda new=new, home=home: _exchange(new, home)))
        steps += record_steps[:1]
        for place in self._waiting:
            if self.is_new(place.parent):
                continue
            steps.append((place, lambda place=place: self._waiting[place].replace(place)))
        for place, was in self._removed.items():
            if was is not None and _seen(place) == was:
                steps.append((place, lambda place=place: place.unlink(missing_ok=True)))
        return steps + record_steps[1:]

    def _record_steps(self, record: Record) -> list[tuple[Path, Callable[[], object]]]:
        place = record.place
        if self.is_new(place.parent):
            after = self._written(place, record.after)
            after.replace(after.with_name(place.name))
            return []
        files = [self._written(place, content) for content in (record.during, record.after)]
        return [(place, lambda file=file: file.replace(place)) for file in files]

    def _not_in_place(self, done: int, total: int, problem: OSError) -> InputError:
        folders = " and ".join(sorted({str(place.parent) for place in (*self._waiting, *self._removed)}))
        if not done:
            return InputError(
                "E-FILE-017",
                f"{folders} could not be written to ({_reason(problem)}); nothing there was changed.",
            )
        return InputError(
            "E-FILE-016",
            f"{folders} holds files of two runs, as the next one after {done} of {total} changes failed ({_reason(problem)}); mend that, "
            "and run it again.",
        )

    def _refuse_changed(self) -> None:
        changed = [
            place for place, was in self._before.items() if place in self._waiting and _seen(place) != was
        ]
        changed += [new for new in self._new if new.exists() and not (new.is_dir() and _is_empty(new))]
        if changed:
            raise InputError(
                "E-FILE-018",
                f"{changed[0]} was changed by another program while this run was at work; nothing there was changed by this run; run it "
                "again.",
            )

    def discard(self) -> None:
        """Drop the files that wait, unless they have been published."""
        with deferred_signals():
            for path in self._temporaries:
                path.unlink(missing_ok=True)
            for home in self._new.values():
                shutil.rmtree(home, ignore_errors=True)
            for folder in self._made:
                with suppress(OSError):  # there is something in it
                    folder.rmdir()
            self._locks.close()

    def _temporary(self, path: Path) -> Path:
        try:
            refuse_irregular(path)
            self._refuse_link_to(path)
            place = _place(path)
            self._before.setdefault(place, _seen(place))
            return self._fresh(self._home(place.parent), place.suffix)
        except OSError as problem:
            raise InputError(
                "E-FILE-012", f"{path} cannot be written ({_reason(problem)}); choose a folder that can."
            ) from problem

    def _put(self, path: Path, temporary: Path) -> None:
        place = _place(path)
        with temporary.open("r+b") as stream:
            os.fsync(stream.fileno())
        temporary.chmod(_mode_of(place))
        earlier = self._waiting.pop(place, None)  # what is written last takes its place last
        if self.is_new(place.parent):
            named = temporary.with_name(place.name)
            temporary.replace(named)
            self._temporaries.discard(temporary)
            self._waiting[place] = named
        else:
            self._waiting[place] = temporary
            if earlier is not None:
                self._temporaries.discard(earlier)
                earlier.unlink()

    def _written(self, place: Path, content: bytes) -> Path:
        """Temporary file for a place, complete and synchronised, which does not wait."""
        temporary = self._fresh(self._home(place.parent), place.suffix)
        with temporary.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.chmod(_mode_of(place))
        return temporary

    def _home(self, folder: Path) -> Path:
        """Folder in which files for a folder wait: itself, or, where it is not there, one beside it that takes its place as a whole."""
        for new, home in self._new.items():
            if _is_in(folder, new):
                inner = home / folder.relative_to(new)
                inner.mkdir(parents=True, exist_ok=True)
                return inner
        if folder.exists():
            return folder
        with deferred_signals():
            self._made += [path for path in (folder, *folder.parents) if not path.exists()]
            folder.mkdir(parents=True)  # empty: paths lead through it
            home = _random_name(folder.parent, "")
            home.mkdir()
            self._new[folder] = home
        return home

    def _fresh(self, home: Path, suffix: str) -> Path:
        """A new empty file under a random name."""
        with deferred_signals():
            path = _random_name(home, suffix)
            os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
            self._temporaries.add(path)
        return path

    def _drop(self, temporary: Path) -> None:
        if temporary in self._temporaries and temporary not in self._waiting.values():
            temporary.unlink(missing_ok=True)
            self._temporaries.discard(temporary)

    def _refuse_link_to(self, path: Path) -> None:
        if self._root is not None:
            refuse_linked_folder(path, self._root)


_on_disk: ContextVar[bool] = ContextVar("on_disk", default=False)


@contextmanager
def files_on_disk() -> Iterator[None]:
    """Within it `current_path` leads to the files that are in their places, not to those that wait."""
    token = _on_disk.set(True)
    try:
        yield
    finally:
        _on_disk.reset(token)


def current_path(path: str | Path) -> Path:
    """Path to read `path` from: the file that waits for this place in the running transaction, else the path itself.

    Raises `InputError` where this is a pipe, socket or device.
    """
    place = (_open[-1].waiting(Path(path)) if _open and not _on_disk.get() else None) or Path(path)
    refuse_stream(place)
    return place


def left_over(folder: Path) -> list[str]:
    """Names of temporary files and folders in a folder: of runs that were cut off, or are at work."""
    try:
        return sorted(name for name in os.listdir(folder) if name.startswith(TEMPORARY))
    except OSError:
        return []


def _place(path: Path) -> Path:
    return Path(os.path.realpath(path.parent)) / path.name


def _is_in(folder: Path, other: Path) -> bool:
    return folder == other or other in folder.parents


def _is_empty(folder: Path) -> bool:
    return next(folder.iterdir(), None) is None


def _random_name(folder: Path, suffix: str) -> Path:
    return folder / f"{TEMPORARY}{os.urandom(8).hex()}{suffix}"


def _exchange(empty: Path, folder: Path) -> None:
    """Put a folder in the place of an empty one."""
    if os.name == "nt":
        empty.rmdir()
    folder.rename(empty)


def _seen(place: Path) -> Seen:
    """State of a file that changes whenever it is written anew."""
    try:
        status = place.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return status.st_size, status.st_mtime_ns


def _mode_of(place: Path) -> int:
    """The permissions of the file being replaced, else those that a new file would get."""
    if place.exists():
        return place.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def _sync_folder(folder: Path) -> None:
    """Synchronise the names in a folder to disk, where the system can."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    except OSError as problem:
        if problem.errno not in (errno.EINVAL, errno.ENOTSUP):  # file systems that do it by themselves
            raise InputError(
                "E-FILE-028",
                f"all files of this run are in place in {folder}, but the disk has not confirmed it ({_reason(problem)}); check the disk.",
            ) from problem
    finally:
        os.close(handle)


def _reason(problem: OSError) -> str:
    return problem.strerror or str(problem)
