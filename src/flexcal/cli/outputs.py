"""Protection of existing files: `--out` overwrites only unchanged files of the same verb."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from flexcal.data import page_beside
from flexcal.errors import InputError
from flexcal.estimates_file import sha256_of

LEDGER = ".flexcal"
"""In every folder that `--out` named: SHA-256 and name of what flexcal wrote there, as sha256sum has it, each verb's lines under a comment
that names it; of a name the last line counts."""
_COMMENT = "# flexcal "
_REPORT = "report"
"""The verb that makes the pages of the others anew."""


@contextmanager
def outputs(verb: str, out: Path | None, names: Sequence[str] = (), *, page: bool = False) -> Iterator[None]:
    """Around `verb`, which writes the file `out`, or into the folder `out` the files `names` (glob patterns); None writes nothing.

    With `page`, it also writes an HTML file of the same name beside `out`.

    Raises `InputError` beforehand where the folder cannot be written to, and where one of the files is there already that flexcal did
    not write, that another verb wrote, or that was changed since. When the verb fails, what it made is removed again; when it succeeds, so
    is what an earlier run left under these names.
    """
    if out is None:
        yield
        return
    if not names and out.is_dir():
        raise InputError(f"{out} is a folder; name a file in it with --out.")
    folder = out if names else out.parent
    patterns = names or [glob.escape(path.name) for path in (out, *([page_beside(out)] if page else []))]
    made = _make(folder)
    known = _ledger(folder)
    before = _present(folder, patterns)
    try:
        for path in before:
            digest, writer = known.get(path.name, ("", ""))
            if digest != sha256_of(path):
                raise InputError(
                    f"{path} was not written by flexcal, or has been changed since, and such a file is never changed; "
                    f"{'' if verb == _REPORT else 'give another --out, or '}move it away."
                )
            if writer not in ("", verb, _REPORT) and verb != _REPORT:
                place = "a folder" if names else "a file"
                raise InputError(
                    f"{path} was written by 'flexcal {writer}', which another verb does not write over; "
                    f"give 'flexcal {verb}' {place} of its own with --out."
                )
        yield
    except BaseException:
        for path in _present(folder, patterns).keys() - before.keys():
            path.unlink()
        _record(verb, folder, _present(folder, patterns), before, known)
        for path in made:
            with suppress(OSError):
                path.rmdir()
        raise
    after = _present(folder, patterns)
    for path in before:
        if after.get(path) == before[path]:
            path.unlink()
    _record(verb, folder, after, before, known)


def _make(folder: Path) -> list[Path]:
    """Make a folder; the folders that had to be made for it, the innermost first."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError(f"{folder} cannot be written to (it is a file); choose another --out.") from None
    except OSError as problem:
        raise InputError(
            f"{folder} cannot be written to ({problem.strerror or problem}); choose another --out."
        ) from problem
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"{folder} cannot be written to (permission denied); choose another --out.")
    return missing


def _present(folder: Path, patterns: Sequence[str]) -> dict[Path, tuple[int, int]]:
    """The files there by these names, and what changes whenever one is written anew."""
    files = {path for pattern in patterns for path in folder.glob(pattern) if path.is_file()}
    return {path: (path.stat().st_ino, path.stat().st_mtime_ns) for path in sorted(files)}


def written_in(folder: Path) -> dict[str, str]:
    """SHA-256 by name of what flexcal wrote into a folder."""
    return {name: digest for name, (digest, _) in _ledger(folder).items()}


def _ledger(folder: Path) -> dict[str, tuple[str, str]]:
    """Digest and verb of every file; the verb is empty where an older flexcal did not write it down."""
    path, verb = folder / LEDGER, ""
    found: dict[str, tuple[str, str]] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else []:
        if line.startswith("#"):
            verb = line.removeprefix(_COMMENT)
        else:
            digest, _, name = line.partition("  ")
            found[name] = (digest, verb)
    return found


def _record(
    verb: str,
    folder: Path,
    present: dict[Path, tuple[int, int]],
    before: dict[Path, tuple[int, int]],
    known: dict[str, tuple[str, str]],
) -> None:
    """Add what was written anew, in one write, so that verbs which run at the same time do not lose each other's lines."""
    written = {path.name: sha256_of(path) for path in present if present[path] != before.get(path)}
    lines = [f"{digest}  {name}\n" for name, digest in written.items() if known.get(name) != (digest, verb)]
    if lines:
        with (folder / LEDGER).open("a", encoding="utf-8") as stream:
            stream.write("".join([f"{_COMMENT}{verb}\n", *lines]))
