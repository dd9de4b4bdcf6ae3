"""Words of the messages."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from typing import Any

from flexcal.printable import excerpt

UNQUOTED = object()
"""Stands for a file that is no mapping and no list: probably none of flexcal's, so that no message may show what it holds."""
_DIGITS = 40
"""Digits of a whole number that a message quotes."""


def suggestion(word: str, known: Sequence[str], most: int = 1) -> str:
    """`; did you mean '…'?` with the nearest known words, at `most` so many, or nothing."""
    near = [f"'{name}'" for name in difflib.get_close_matches(word, known, n=most, cutoff=0.5)]
    return f"; did you mean {' or '.join(near)}?" if near else ""


def describe(value: Any) -> str:
    """A value as a message quotes it."""
    if value is None:
        return "nothing"
    if value is UNQUOTED:
        return "a single value"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, str):
        return f"the text '{excerpt(value)}'"
    return f"{value:.6g}" if isinstance(value, int) and abs(value) > 10**_DIGITS else str(value)
