"""Keys of plain data: how they are written, and under which a dataclass's fields stand in a file."""

from __future__ import annotations

import dataclasses
from typing import Any

Keys = tuple[str | int, ...]


def dotted(keys: Keys) -> str:
    """Keys as people write them: `elastic[0].drive`."""
    text = ""
    for key in keys:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else str(key)
    return text


def file_key(field: dataclasses.Field[Any]) -> str:
    """The key under which a dataclass's field stands in a file: its name, or `field(metadata={"key": …})`.

    `field(metadata={"joints": True})` marks joint indices: counted from 0 in the program, from 1 in files, as the
    columns q1…qn are.
    """
    return field.metadata.get("key", field.name)


def known_keys(cls: Any) -> list[str]:
    """The keys that a dataclass's mapping may have."""
    return [file_key(field) for field in dataclasses.fields(cls) if field.init]
