"""What was chosen in the window: kept in the project's folder, so that a restart goes on where it was."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flexcal.errors import FlexcalError
from flexcal.files.formats import parse_json
from flexcal.files.transaction import read_text, write_text

FILE = ".studio.json"
_LARGEST = 100_000
"""Bytes of a file of choices; a larger one is not ours."""


@dataclass
class Choices:
    """Values by name, such as the file that a step reads; written when they change.

    A file that cannot be read is ignored: every choice has a default.
    """

    folder: Path
    values: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def read(cls, folder: Path) -> Choices:
        """Choices of a project's folder."""
        try:
            values = parse_json(folder / FILE, read_text(folder / FILE, limit=_LARGEST), "remove it")
        except (FlexcalError, OSError, UnicodeDecodeError):
            values = {}
        return cls(folder, values if isinstance(values, dict) else {})

    def get(self, name: str, default: Any) -> Any:
        """A choice, of the type of `default`; that where it was not made."""
        value = self.values.get(name, default)
        return value if isinstance(value, type(default)) else default

    def number(self, name: str, default: float, least: float = 0.0, most: float | None = None) -> float:
        """A choice of a number, of the type of `default`; that where it was not made, or is not from `least` to `most`."""
        value = self.get(name, default)
        return value if least <= value <= (1e9 if most is None else most) else default

    def among(self, name: str, options: Sequence[str], default: str | None = None) -> str:
        """A choice among texts, where it is still one of them; else `default`, by default the first."""
        kept = self.get(name, "")
        return kept if kept in options else options[0] if default is None else default

    def put(self, name: str, value: Any) -> None:
        """Keep a choice; a folder that cannot be written keeps none."""
        if self.values.get(name) == value:
            return
        self.values[name] = value
        try:
            write_text(self.folder / FILE, json.dumps(self.values, indent=1))
        except (FlexcalError, OSError):
            return  # the choice holds until the end
