"""Functions that expressions of xacro files may call."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

from flexcal.export.xacro_expressions import (
    LARGEST_VALUE,
    DottedDict,
    Function,
    Methods,
    Namespace,
    Refused,
)

_MATH = (
    *(
        "acos",
        "acosh",
        "asin",
        "asinh",
        "atan",
        "atan2",
        "atanh",
        "cos",
        "cosh",
        "degrees",
        "radians",
        "sin",
        "sinh",
        "tan",
        "tanh",
    ),
    *("ceil", "copysign", "fabs", "floor", "fmod", "fsum", "remainder", "trunc"),
    *("exp", "expm1", "hypot", "log", "log10", "log1p", "log2", "pow", "sqrt"),
    *("isclose", "isfinite", "isinf", "isnan"),
)
_CONSTANTS = ("pi", "e", "tau", "inf", "nan")
_LONGEST_RANGE = 10_000
_MOST_DIGITS = 400
"""Digits of a number that is made of text, or rounded to."""


def _int(value: Any = 0) -> int:
    if type(value) is str and len(value) > _MOST_DIGITS:
        raise ValueError("the number has too many digits")
    return int(value)


def _round(value: float, digits: int | None = None) -> float:
    if digits is not None and abs(digits) > _MOST_DIGITS:
        raise ValueError("it cannot be rounded so far")
    return round(value, digits)


def _range(*ends: int) -> list[int]:
    numbers = range(*ends)
    if len(numbers) > _LONGEST_RANGE:
        raise ValueError(f"a range has at most {_LONGEST_RANGE} numbers")
    return list(numbers)


def _sum(values: Any, first: float = 0) -> float:
    if not all(type(value) in (bool, int, float) for value in (first, *values)):
        raise TypeError("only numbers are summed")
    return sum(values, first)


def _tokenize(text: str, sep: str = ",; ", skip_empty: bool = True) -> list[str]:
    _texts(text, sep)
    parts = re.split(f"[{re.escape(sep)}]", text) if sep else [text]
    return [part for part in parts if part] if skip_empty else parts


def _fatal(*said: Any) -> None:
    raise Refused(f"the file says: {' '.join(str(part) for part in said)[:200]}")


def _silent(*_: Any, **__: Any) -> str:
    """In place of what prints: nothing that a file says reaches the terminal."""
    return ""


def functions(
    load_yaml: Callable[[str], Any], place: Callable[[str], str], argument: Callable[[str], Any]
) -> dict[str, Any]:
    """Names of all files: as xacro has them, but for those that are of no use for a robot.

    `load_yaml` reads a file, `place` is the path of a name in the folder of the file at work, and `argument` the value of an argument.
    """
    python: dict[str, Any] = {
        "list": Function(list),
        "dict": Function(dict, keywords=True),
        "len": Function(len),
        "str": Function(str),
        "float": Function(float),
        "int": Function(_int),
        "bool": Function(bool),
        "min": Function(min),
        "max": Function(max),
        "round": Function(_round),
        "sorted": Function(sorted),
        "range": Function(_range),
        "abs": Function(abs),
        "all": Function(all),
        "any": Function(any),
        "divmod": Function(divmod),
        "sum": Function(_sum),
        "tuple": Function(tuple),
    }
    of_math: dict[str, Any] = {name: Function(getattr(math, name)) for name in _MATH}
    of_math |= {name: getattr(math, name) for name in _CONSTANTS}
    files = {
        "load_yaml": Function(load_yaml),
        "abs_filename": Function(place),
        "dotify": Function(lambda value: DottedDict(value)),
    }
    own = {
        **files,
        "arg": Function(argument),
        "tokenize": Function(_tokenize, keywords=True),
        "fatal": Function(_fatal),
        **{
            name: Function(_silent, keywords=True)
            for name in ("message", "warning", "error", "print_location")
        },
    }
    namespaces = {"math": Namespace(of_math), "python": Namespace(python), "xacro": Namespace(own)}
    return {**python, **of_math, **files, **namespaces}


def _texts(*texts: Any) -> None:
    if not all(type(text) is str for text in texts):
        raise TypeError("it takes texts alone")


def _of_texts(method: Callable[..., Any]) -> Callable[..., Any]:
    def called(*texts: Any) -> Any:
        _texts(*texts)
        return method(*texts)

    return called


def _joined(separator: str, parts: Any) -> str:
    _texts(*parts)
    if sum(map(len, parts)) + len(separator) * len(parts) > LARGEST_VALUE:
        raise ValueError("the value is too large")
    return separator.join(parts)


def _replaced(text: str, old: str, new: str) -> str:
    _texts(old, new)
    if len(text) + text.count(old) * len(new) > LARGEST_VALUE:
        raise ValueError("the value is too large")
    return text.replace(old, new)


METHODS: Methods = {
    **{
        (str, method.__name__): _of_texts(method)
        for method in (
            str.lower,
            str.upper,
            str.title,
            str.capitalize,
            str.strip,
            str.lstrip,
            str.rstrip,
            str.split,
            str.startswith,
            str.endswith,
            str.isdigit,
        )
    },
    (str, "join"): _joined,
    (str, "replace"): _replaced,
    (dict, "get"): dict.get,
    (dict, "keys"): lambda owner: list(owner.keys()),
    (dict, "values"): lambda owner: list(owner.values()),
    (dict, "items"): lambda owner: list(owner.items()),
}
