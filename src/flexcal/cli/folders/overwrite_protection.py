"""Protection of existing files: `--out` overwrites only unchanged files of the same verb, and all of them together."""

from __future__ import annotations

import glob
import hashlib
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from flexcal.cli.folders.ledger import LEDGER, Ledger
from flexcal.data.plans import page_beside
from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import (
    FileTransaction,
    Stage,
    age,
    living_owner,
    recover,
    refuse_irregular,
    stages_in,
)

_ALL = "**"
"""Pattern of all files of a folder and of those in it, but hidden ones."""
_REPORT = "report"
"""The verb that makes the pages of the others anew."""


@contextmanager
def outputs(
    verb: str,
    out: Path | None,
    names: Sequence[str] = (),
    *,
    page: bool = False,
    beside: Sequence[str] = (),
) -> Iterator[None]:
    """Around `verb`, which writes the file `out`, or into the folder `out` the files `names` (glob patterns; `**`: all, those in its
    folders too); None writes nothing there.

    With `page`, it also writes an HTML file of the same name beside `out`, and files whose names end, after its stem, as `beside` says.

    Raises `InputError` beforehand where the folder cannot be written to, where another run is at work on these files, and where one of them
    is there already that flexcal did not write, that another verb wrote, or that was changed since. All that the verb writes, there and
    elsewhere, appears when it has succeeded, and what an earlier run left under these names goes; when it fails, nothing changes.
    """
    if out is None:
        with FileTransaction():
            yield
        return
    if not names and out.is_dir():
        raise InputError("E-CLI-010", f"{out} is a folder; name a file in it with --out.")
    folder = out if names else out.parent
    own = [glob.escape(path.name) for path in (out, *([page_beside(out)] if page else []))]
    patterns = names or [*own, *(glob.escape(out.stem) + ending for ending in beside)]
    if folder.is_dir():
        recover(folder)
    place = _Place(verb, folder, patterns, whole_folder=bool(names))
    place.own_files()
    with FileTransaction() as run:
        place.refuse_others(place.stage(run))
        yield
        run.publish(lambda: place.enter(run))


class _Place:
    """The files in a folder that a verb writes."""

    def __init__(self, verb: str, folder: Path, patterns: Sequence[str], *, whole_folder: bool) -> None:
        self.verb, self.folder, self.patterns = verb, folder, tuple(patterns)
        self.kind = "a folder" if whole_folder else "a file"

    def stage(self, run: FileTransaction) -> Stage:
        """Stage of the run; raises `InputError` if the folder cannot be made or written to."""
        try:
            return run.stage(self.folder, f"flexcal {self.verb}", self.patterns)
        except OSError as problem:
            reason = problem.strerror or str(problem)
            if isinstance(problem, FileExistsError | NotADirectoryError):
                reason = "it is a file" if self.folder.is_file() else "it is no folder"
            raise InputError(
                "E-CLI-011", f"{self.folder} cannot be written to ({reason}); choose another --out."
            ) from problem

    def refuse_others(self, own: Stage) -> None:
        """Raise `InputError` where another run is at work on some of the same files."""
        for stage in stages_in(own.folder):
            owner = living_owner(stage) if age(stage) < age(own.path) else None
            if owner is not None and self._overlap(owner.names):
                raise InputError(
                    "E-CLI-012",
                    f"'{owner.verb}' (process {owner.process}) is writing into {self.folder} just now; wait for its end, or give another "
                    f"--out; or, where no such process runs, remove {stage}.",
                )

    def own_files(self) -> dict[Path, str]:
        """Files there that this verb may write over, with their SHA-256; raises `InputError` for the first that it may not."""
        known = Ledger.read(self.folder).entries if self.folder.is_dir() else {}
        digests: dict[Path, str] = {}
        for path in self._present():
            refuse_irregular(path)
            digest, writer = known.get(self._name(path), ("", ""))
            if digest != _digest_on_disk(path):
                raise InputError(
                    "E-CLI-013",
                    f"{path} was not written by flexcal, or has been changed since, and such a file is never changed; "
                    f"{'' if self.verb == _REPORT else 'give another --out, or '}move it away.",
                )
            if writer not in ("", self.verb, _REPORT) and self.verb != _REPORT:
                raise InputError(
                    "E-CLI-014",
                    f"{path} was written by 'flexcal {writer}', which another verb does not write over; "
                    f"give 'flexcal {self.verb}' {self.kind} of its own with --out.",
                )
            digests[path] = digest
        return digests

    def enter(self, run: FileTransaction) -> None:
        """Add to the files of a run the ledger with them, and remove those of an earlier one that it did not write again."""
        home = Path(os.path.realpath(self.folder))
        written = {place: file for place, file in run.files.items() if self._is_mine(place, home)}
        for path in self.own_files():
            if home / self._name(path) not in written:
                run.remove(path)
        if written:
            digests = {
                place.relative_to(home).as_posix(): _digest_on_disk(file) for place, file in written.items()
            }
            ledger = run.temporary(self.folder / LEDGER)
            ledger.write_bytes(Ledger.read(self.folder).with_files(self.verb, digests).content())
            run.put(self.folder / LEDGER, ledger)

    def _present(self) -> list[Path]:
        if _ALL in self.patterns:
            found = sorted(path for path in self.folder.rglob("*") if not path.is_dir())
            return [path for path in found if self._is_named(self._name(path))]
        try:
            names = sorted(os.listdir(self.folder))
        except OSError:  # there is none, or what is wrong with it is seen when it is written to
            return []
        return [self.folder / name for name in names if self._is_named(name)]

    def _name(self, path: Path) -> str:
        """Name in the folder, with the folders in it before."""
        return path.relative_to(self.folder).as_posix()

    def _is_mine(self, place: Path, home: Path) -> bool:
        if _ALL in self.patterns:
            return place.is_relative_to(home) and self._is_named(place.relative_to(home).as_posix())
        return place.parent == home and self._is_named(place.name)

    def _is_named(self, name: str) -> bool:
        if _ALL in self.patterns:
            return not any(part.startswith(".") for part in name.split("/"))
        return any(fnmatchcase(name, pattern) for pattern in self.patterns)

    def _overlap(self, others: Sequence[str]) -> bool:
        return any(fnmatchcase(one, two) or fnmatchcase(two, one) for one in self.patterns for two in others)


def _digest_on_disk(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as problem:
        raise unreadable(path, problem, "give another --out") from problem


def complete_interrupted_runs(parsed: Any) -> None:
    """Finish what a run that was cut off has left in the folders of all paths among the arguments, so that files of one run are read there.

    Raises `InputError` where that is not possible.
    """
    given = [
        item for value in vars(parsed).values() for item in (value if isinstance(value, tuple) else (value,))
    ]
    paths = [item for item in given if isinstance(item, Path)]
    for folder in {path if path.is_dir() else path.parent for path in paths}:
        recover(folder)
