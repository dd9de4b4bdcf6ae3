"""Bounded reading of JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import MEGABYTE, read_bytes
from flexcal.printable import excerpt
from flexcal.units import LARGEST

LARGEST_JSON = 64 * MEGABYTE
MOST_VALUES = 3_000_000
"""Largest number of values, by the brackets and commas of the text."""
DEEPEST = 50
"""Largest depth of nested lists and mappings."""


def read_json(path: Path, remedy: str) -> Any:
    """Content of a JSON file; `remedy` ends the sentence of the `InputError` that is raised where it cannot be read."""
    try:
        text = read_bytes(path, limit=LARGEST_JSON).decode("utf-8")
    except (OSError, UnicodeDecodeError) as problem:
        raise unreadable(path, problem, remedy) from problem
    return parse_json(path, text, remedy)


def parse_json(path: Path, text: str, remedy: str) -> Any:
    """Content of the JSON text of a file; raises as `read_json` does."""
    if text.count(",") + text.count("[") + text.count("{") > MOST_VALUES:
        raise InputError("E-FILE-022", f"{path} holds more than {MOST_VALUES} values of JSON; {remedy}.")
    try:
        content = json.loads(text, parse_int=_integer, parse_float=_number, parse_constant=_refused)
    except json.JSONDecodeError as problem:
        raise InputError(
            "E-FILE-023",
            f"{path} line {problem.lineno}, column {problem.colno}: this is no JSON ({problem.msg}); {remedy}.",
        ) from None
    except ValueError as problem:
        reason = str(problem).partition(";")[0]  # of a number of too many digits Python's advice follows
        raise InputError("E-FILE-024", f"{path}: this is no JSON ({reason}); {remedy}.") from None
    except RecursionError:
        raise _too_deep(path, remedy) from None
    inner = [content]
    for _ in range(DEEPEST + 1):
        inner = [
            item
            for value in inner
            if isinstance(value, dict | list)
            for item in (value.values() if isinstance(value, dict) else value)
        ]
        if not inner:
            return content
    raise _too_deep(path, remedy)


def _number(digits: str) -> float:
    if abs(number := float(digits)) > LARGEST:
        raise ValueError(f"{excerpt(digits)} is beyond {LARGEST:.0e}")
    return number


def _integer(digits: str) -> int:
    _number(digits)
    return int(digits)


def _refused(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is no number of JSON")


def _too_deep(path: Path, remedy: str) -> InputError:
    return InputError("E-FILE-025", f"{path}: values nest more than {DEEPEST} deep; {remedy}.")
