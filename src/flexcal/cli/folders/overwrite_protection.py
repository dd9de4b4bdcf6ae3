"""Protection of existing files: `--out` overwrites only unchanged files of the same verb, and all of them together."""

from __future__ import annotations

import glob
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path

from flexcal.data.plans import page_beside
from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import (
    LEDGER,
    FileTransaction,
    Ledger,
    Record,
    digest_on_disk,
    left_over,
    locked,
    refuse_irregular,
    refuse_linked_folder,
    refuse_mixture,
    sole_holder,
)
from flexcal.printable import sentence

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
    is_named: bool = True,
) -> Iterator[None]:
    """Around `verb`, which writes the file `out`, or into the folder `out` the files `names` (glob patterns; `**`: all, those in its
    folders too); None writes nothing there.

    With `page`, it also writes an HTML file of the same name beside `out`, and files whose names end, after its stem, as `beside` says.

    Raises `InputError` beforehand where the folder cannot be written to, or is a link that the command line does not name (`is_named`),
    where another run is at work on these files, and where one of them is there already that flexcal did not write, that another verb
    wrote, or that was changed since. All that the verb writes, there and
    elsewhere, appears when it has succeeded, and what an earlier run left under these names goes; when it fails, nothing changes.
    """
    if out is None:
        with FileTransaction():
            yield
        return
    if not names and out.is_dir():
        raise InputError("E-CLI-010", f"{out} is a folder; name a file in it with --out.")
    folder = out if names else out.parent
    if names and not is_named:
        refuse_linked_folder(out / names[0], out.parent)
    own = [glob.escape(path.name) for path in (out, *([page_beside(out)] if page else []))]
    patterns = names or [*own, *(glob.escape(out.stem) + ending for ending in beside)]
    place = _Place(verb, folder, patterns, whole_folder=bool(names))
    with sole_holder(out, "run", f"'flexcal {verb}' (process {os.getpid()})") as other:
        if other is not None:
            raise InputError(
                "E-CLI-012", f"{other} is writing {out} just now; wait for its end, or give another --out."
            )
        place.own_files()
        place.name_left_overs()
        with FileTransaction(folder) as run:
            place.reserve(run)
            yield
            with locked(folder / LEDGER):
                run.publish(place.record(run))


class _Place:
    """The files in a folder that a verb writes."""

    def __init__(self, verb: str, folder: Path, patterns: Sequence[str], *, whole_folder: bool) -> None:
        self.verb, self.folder, self.patterns = verb, folder, tuple(patterns)
        self.kind = "a folder" if whole_folder else "a file"

    def reserve(self, run: FileTransaction) -> None:
        """Raise `InputError` if the folder cannot be made or written to."""
        try:
            run.reserve(self.folder)
        except OSError as problem:
            reason = problem.strerror or str(problem)
            if isinstance(problem, FileExistsError | NotADirectoryError):
                reason = "it is a file" if self.folder.is_file() else "it is no folder"
            raise InputError(
                "E-CLI-011", f"{self.folder} cannot be written to ({reason}); choose another --out."
            ) from problem

    def name_left_overs(self) -> None:
        """Say on standard error what runs that were cut off have left here: only a person removes it."""
        left = [place / name for place in (self.folder, self.folder.parent) for name in left_over(place)]
        if left:
            more = f" and {len(left) - 1} more" if len(left) > 1 else ""
            print(
                f"note: {sentence(str(left[0]))}{more}: left by a run that was cut off, or of one that is at work; may be removed when no "
                "flexcal is",
                file=sys.stderr,
            )

    def own_files(self) -> list[Path]:
        """Files there that this verb may write over; raises `InputError` for the first that it may not."""
        ledger = Ledger.read(self.folder) if self.folder.is_dir() else Ledger({})
        if ledger.change and ledger.verb != self.verb:
            refuse_mixture(self.folder)
        present = self._present()
        for path in present:
            refuse_linked_folder(path, self.folder)
            refuse_irregular(path)
            writer = ledger.written_by(self._name(path), _digest(path))
            if writer is None:
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
        return present

    def record(self, run: FileTransaction) -> Record | None:
        """The ledger while the files of a run are put in place, and afterwards; those of an earlier run that it did not write again go."""
        home = Path(os.path.realpath(self.folder))
        written = {place: file for place, file in run.files.items() if self._is_mine(place, home)}
        digests = {place.relative_to(home).as_posix(): _digest(file) for place, file in written.items()}
        own = self.own_files()
        # of a verb whose input names its files, those that it does not write again stay: they may be named by somebody else
        gone = [] if _ALL in self.patterns else [path for path in own if self._name(path) not in digests]
        for path in gone:
            run.remove(path)
        if not written:
            return None
        ledger = Ledger.read(self.folder).settled(self.folder)
        change = digests | {self._name(path): "" for path in gone}
        return Record(
            home / LEDGER,
            ledger.changing(self.verb, change).content(),
            ledger.with_files(self.verb, change).content(),
        )

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


def _digest(path: Path) -> str:
    try:
        return digest_on_disk(path)
    except OSError as problem:
        raise unreadable(path, problem, "give another --out") from problem
