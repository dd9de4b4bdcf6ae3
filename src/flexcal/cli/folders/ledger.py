"""The ledger of a folder: what flexcal wrote there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import unreadable
from flexcal.files.transaction import current_path

LEDGER = ".flexcal"
"""In every folder that `--out` named: SHA-256 and name of what flexcal wrote there, as sha256sum has it, each verb's lines under a comment
that names it; of a name the last line counts."""
_COMMENT = "# flexcal "


@dataclass(frozen=True)
class Ledger:
    """Digest and verb of every file, by name; the verb is empty where an older flexcal did not write it down."""

    entries: Mapping[str, tuple[str, str]]

    @classmethod
    def read(cls, folder: Path) -> Ledger:
        """Ledger of a folder, empty if there is none; raises `InputError` if it cannot be read."""
        path, verb = folder / LEDGER, ""
        entries: dict[str, tuple[str, str]] = {}
        try:
            lines = current_path(path).read_bytes().decode("utf-8", "surrogateescape").split("\n")
        except FileNotFoundError:
            return cls(entries)
        except OSError as problem:
            raise unreadable(path, problem, "give another --out") from problem
        for line in lines:
            if line.startswith("#"):
                verb = line.removeprefix(_COMMENT)
            else:
                digest, _, name = line.partition("  ")
                if digest.startswith("\\"):
                    digest, name = digest[1:], name.replace("\\n", "\n").replace("\\\\", "\\")
                entries[name] = (digest, verb)
        entries.pop("", None)
        return cls(entries)

    def with_files(self, verb: str, digests: Mapping[str, str]) -> Ledger:
        """The ledger with what `verb` wrote, SHA-256 by name."""
        return Ledger({**self.entries, **{name: (digest, verb) for name, digest in digests.items()}})

    def content(self) -> bytes:
        """The file."""
        lines: list[str] = []
        for verb in dict.fromkeys(verb for _, verb in self.entries.values()):
            lines += [f"{_COMMENT}{verb}"] if verb else []
            lines += [_line(name, digest) for name, (digest, of) in self.entries.items() if of == verb]
        return "".join(f"{line}\n" for line in lines).encode("utf-8", "surrogateescape")


def _line(name: str, digest: str) -> str:
    """As sha256sum writes names with a backslash or a line break."""
    if "\\" in name or "\n" in name:
        return f"\\{digest}  {name.replace(chr(92), chr(92) * 2).replace(chr(10), chr(92) + 'n')}"
    return f"{digest}  {name}"
