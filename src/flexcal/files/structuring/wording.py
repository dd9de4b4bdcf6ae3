"""Words of the messages."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from typing import Any

_QUOTED = 40
"""Letters of a value that a message quotes."""


def suggestion(word: str, known: Sequence[str], most: int = 1) -> str:
    """`; did you mean '…'?` with the nearest known words, at `most` so many, or nothing."""
    near = [f"'{name}'" for name in difflib.get_close_matches(word, known, n=most, cutoff=0.5)]
    return f"; did you mean {' or '.join(near)}?" if near else ""


def describe(value: Any) -> str:
    """A value as a message quotes it."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, str):
        text = " ".join(value.split())
        return f"the text '{text if len(text) <= _QUOTED else text[: _QUOTED - 1] + '…'}'"
    return f"{value:.6g}" if isinstance(value, int) and abs(value) > 10**_QUOTED else str(value)
