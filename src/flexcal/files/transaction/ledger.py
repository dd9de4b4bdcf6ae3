"""The ledger of a folder: what flexcal wrote there."""

from __future__ import annotations

import hashlib
import os
import re
import stat
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from flexcal.errors import InputError, unreadable
from flexcal.files.transaction.file_transaction import files_on_disk
from flexcal.files.transaction.reading import MEGABYTE, open_regular, read_bytes

LEDGER = ".flexcal"
"""In every folder that `--out` named: SHA-256 and name of what flexcal wrote there, as sha256sum has it, each verb's lines under a comment
that names it."""
_COMMENT = "# flexcal "
_CHANGE = "# being written: flexcal "
_VERB = re.compile(r"[a-z]+(-[a-z]+)*( [a-z]+(-[a-z]+)*)?")
_LARGEST, _LARGEST_LEDGER = 2 * 1000 * MEGABYTE, 10 * MEGABYTE
"""Bytes of a file that a verb writes, and of a ledger, at most."""


@dataclass(frozen=True)
class Ledger:
    """Digest and verb of every file, by name; the verb is empty where an older flexcal did not write it down.

    While a run puts its files in place, `change` has its digests by name, and `verb` is the run's. Where that was cut off they stay, and
    each file is the one of before or that of the run.
    """

    entries: Mapping[str, tuple[str, str]]
    change: Mapping[str, str] = field(default_factory=dict)
    verb: str = ""

    @classmethod
    def read(cls, folder: Path) -> Ledger:
        """Ledger of a folder, empty if there is none; raises `InputError` if it cannot be read."""
        path, verb, changing = folder / LEDGER, "", ""
        entries: dict[str, tuple[str, str]] = {}
        change: dict[str, str] = {}
        try:
            lines = read_bytes(path, limit=_LARGEST_LEDGER).decode("utf-8", "surrogateescape").split("\n")
        except FileNotFoundError:
            return cls(entries)
        except OSError as problem:
            raise unreadable(path, problem, "give another --out") from problem
        for line in lines:
            if line.startswith(_CHANGE):
                changing = _verb(line.removeprefix(_CHANGE))
            elif line.startswith("#"):
                verb = _verb(line.removeprefix(_COMMENT))
            else:
                digest, _, name = line.partition("  ")
                if digest.startswith("\\"):
                    digest, name = digest[1:], name.replace("\\n", "\n").replace("\\\\", "\\")
                if _is_below(name) and changing:
                    change[name] = digest
                elif _is_below(name):
                    entries[name] = (digest, verb)
        return cls(entries, change, changing)

    def written_by(self, name: str, digest: str) -> str | None:
        """Verb that wrote a file of this name and content; None where flexcal did not."""
        stored, verb = self.entries.get(name, ("", ""))
        if digest == self.change.get(name):
            return self.verb
        return verb if digest == stored else None

    def settled(self, folder: Path) -> Ledger:
        """The ledger of the files that are there, where a run was cut off while it put its files in place."""
        entries = dict(self.entries)
        for name, digest in self.change.items():
            if _found(folder / name) == digest:
                entries.pop(name, None)
                entries |= {name: (digest, self.verb)} if digest else {}
        return Ledger(entries)

    def changing(self, verb: str, digests: Mapping[str, str]) -> Ledger:
        """The ledger while `verb` puts files in place, SHA-256 by name, empty for one that goes."""
        return Ledger(self.entries, digests, verb)

    def with_files(self, verb: str, digests: Mapping[str, str]) -> Ledger:
        """The ledger with what `verb` wrote, SHA-256 by name, empty for what went."""
        kept = {name: entry for name, entry in self.entries.items() if name not in digests}
        return Ledger(kept | {name: (digest, verb) for name, digest in digests.items() if digest})

    def content(self) -> bytes:
        """The file."""
        lines: list[str] = []
        for verb in sorted({verb for _, verb in self.entries.values()}):
            lines += [f"{_COMMENT}{verb}"] if verb else []
            lines += [
                _line(name, digest) for name, (digest, of) in sorted(self.entries.items()) if of == verb
            ]
        if self.change:
            lines += [f"{_CHANGE}{self.verb}", *(_line(name, digest) for name, digest in self.change.items())]
        return "".join(f"{line}\n" for line in lines).encode("utf-8", "surrogateescape")


def digest_on_disk(path: Path) -> str:
    """SHA-256 of the regular file that is in its place, whatever waits for it; raises `InputError` for one that no verb has written."""
    with files_on_disk(), open_regular(path, limit=_LARGEST) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def refuse_mixture(folder: Path) -> None:
    """Raise `InputError` where a run was cut off while it put its files in place, and some of them are of the run before."""
    ledger = Ledger.read(folder)
    if ledger.change and len(set(_sides(folder, ledger))) > 1:
        raise InputError(
            "E-FILE-030",
            f"{folder} holds files of two runs, as 'flexcal {ledger.verb}' was cut off while it put its files in place; run it again.",
        )


def _sides(folder: Path, ledger: Ledger) -> Iterator[str]:
    """Which run each file that was to change is of, where its content tells it."""
    for name, new in ledger.change.items():
        if new != ledger.entries.get(name, ("", ""))[0]:
            yield "new" if _found(folder / name) == new else "old"


def _found(path: Path) -> str:
    """SHA-256 of a file, empty where there is none that could have been written."""
    try:
        return digest_on_disk(path) if stat.S_ISREG(path.lstat().st_mode) else ""
    except (FileNotFoundError, NotADirectoryError):
        return ""
    except OSError as problem:
        raise unreadable(path, problem) from problem


def _verb(text: str) -> str:
    return text if _VERB.fullmatch(text) else "another verb"


def _is_below(name: str) -> bool:
    """Whether a name is that of a file in the folder."""
    return bool(name) and "\0" not in name and not os.path.isabs(name) and ".." not in name.split("/")


def _line(name: str, digest: str) -> str:
    """As sha256sum writes names with a backslash or a line break."""
    if "\\" in name or "\n" in name:
        return f"\\{digest}  {name.replace(chr(92), chr(92) * 2).replace(chr(10), chr(92) + 'n')}"
    return f"{digest}  {name}"
