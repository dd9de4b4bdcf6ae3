"""One YAML document as plain Python data with the line of every value, built from libyaml's events.

Bounded, so that no file exhausts the stack, the memory or the patience: a document has at most `MOST_VALUES` values, nested at most
`DEEPEST` deep, and aliases repeat at most `MOST_REPEATED` values.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexcal.errors import InputError
from flexcal.files.structuring import Keys
from flexcal.files.transaction import MEGABYTE
from flexcal.printable import excerpt

if TYPE_CHECKING:
    from yaml import CSafeLoader, Event, ScalarEvent

LARGEST_YAML = 16 * MEGABYTE
MOST_VALUES = 100_000
"""Largest number of values of a document."""
DEEPEST = 50
"""Largest depth of nested lists and mappings."""
MOST_REPEATED = 100_000
"""Largest number of values repeated by aliases, nested ones included."""
_LONGEST_NUMBER = 250
"""Largest number of digits of an integer, in any base that a `float` holds."""
_DECIMAL = re.compile(r"[-+]?[0-9]+")
_OTHER_BASE = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NO_NUMBER = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_NULL = {"", "~", "null", "Null", "NULL"}
_TRUTH = {
    word: value for value in (True, False) for word in (str(value), str(value).lower(), str(value).upper())
}
_TAGS = {f"tag:yaml.org,2002:{name}" for name in ["null", "bool", "int", "float", "str", "seq", "map"]}


def parse_document(path: Path, text: str) -> tuple[Any, dict[Keys, int]]:
    """The data of a text, and the lines of its keys and items (first line is 1; of the whole: ()).

    Scalars follow the core schema of YAML 1.2. Raises `InputError` with `path` and line for text that is not one YAML document, a key
    that is no plain name or stands twice, a tag, an alias of something that contains it, and what exceeds the bounds.
    """
    import yaml
    from yaml import CSafeLoader, MarkedYAMLError, YAMLError

    loader = None
    try:
        loader = CSafeLoader(text)
        document = _Document(path, loader, yaml)
        return document.read(), document.lines
    except MarkedYAMLError as problem:
        mark = problem.problem_mark or problem.context_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}" if mark else "somewhere"
        what = " ".join(str(problem.problem or problem.context or "the text stops").split())
        if "nesting" in what:  # libyaml's own bound, which it meets in what it reads ahead
            raise _too_deep(path, mark.line + 1 if mark else 1) from None
        raise InputError(
            "E-YAML-004", f"{path} {place}: not valid YAML ({what}); correct it there."
        ) from None
    except YAMLError as problem:
        what = " ".join(str(problem).split())
        raise InputError("E-YAML-005", f"{path}: not valid YAML ({what}); correct it.") from None
    finally:
        if loader is not None:
            loader.dispose()


@dataclass
class _Anchored:
    """A value that aliases may repeat; `size` counts the values inside it and is 0 while it is being read."""

    value: Any = None
    size: int = 0


@dataclass
class _Document:
    path: Path
    loader: CSafeLoader
    yaml: Any
    """The package, which is imported where there is something to read."""
    lines: dict[Keys, int] = field(default_factory=dict)
    anchors: dict[str, _Anchored] = field(default_factory=dict)
    values: int = 0
    repeated: int = 0

    def read(self) -> Any:
        self._next()  # the stream's start
        if isinstance(self._next(), self.yaml.StreamEndEvent):
            raise InputError("E-YAML-006", f"{self.path} line 1: the file is empty; write at least one key.")
        data = self._value(self._next(), ())
        self._next()  # the document's end
        following = self._next()
        if isinstance(following, self.yaml.DocumentStartEvent):
            raise self._error("E-YAML-007", following, "a second document begins; keep one in the file.")
        return data

    def _next(self) -> Any:
        event = self.loader.get_event()
        assert event is not None  # no more is asked for after the stream's end
        return event

    def _error(self, code: str, event: Event, sentence: str) -> InputError:
        return InputError(code, f"{self.path} line {event.start_mark.line + 1}: {sentence}")

    def _value(self, event: Any, keys: Keys) -> Any:
        self.values += 1
        if self.values - self.repeated > MOST_VALUES:
            raise self._error(
                "E-YAML-039",
                event,
                f"the file holds more than {MOST_VALUES} values; check that it is the right one.",
            )
        self.lines.setdefault(keys, event.start_mark.line + 1)
        if isinstance(event, self.yaml.AliasEvent):
            return self._repeated(event)
        if event.tag not in (None, "!") and event.tag not in _TAGS:
            raise self._error(
                "E-YAML-008", event, f"the tag '{excerpt(event.tag)}' is not understood; remove it."
            )
        if len(keys) > DEEPEST:
            raise _too_deep(self.path, event.start_mark.line + 1)
        anchored = _Anchored()
        if event.anchor is not None:
            self.anchors[event.anchor] = anchored
        before = self.values
        if isinstance(event, self.yaml.ScalarEvent):
            anchored.value = self._scalar(event)
        elif isinstance(event, self.yaml.SequenceStartEvent):
            anchored.value = self._list(keys)
        else:
            anchored.value = self._mapping(keys)
        anchored.size = 1 + self.values - before
        return anchored.value

    def _repeated(self, event: Any) -> Any:
        anchored = self.anchors.get(event.anchor)
        if anchored is None:
            raise self._error(
                "E-YAML-010",
                event,
                f"the alias '*{excerpt(event.anchor)}' has no anchor before it; write the value out.",
            )
        if not anchored.size:
            raise self._error("E-YAML-011", event, "an alias refers to itself; write the value out.")
        self.repeated += anchored.size
        self.values += anchored.size - 1
        if self.repeated > MOST_REPEATED:
            raise self._error(
                "E-YAML-012", event, f"aliases repeat more than {MOST_REPEATED} values; write them out."
            )
        return anchored.value

    def _list(self, keys: Keys) -> list[Any]:
        data: list[Any] = []
        while not isinstance(event := self._next(), self.yaml.SequenceEndEvent):
            data.append(self._value(event, (*keys, len(data))))
        return data

    def _mapping(self, keys: Keys) -> dict[str, Any]:
        data: dict[str, Any] = {}
        while not isinstance(event := self._next(), self.yaml.MappingEndEvent):
            if not isinstance(event, self.yaml.ScalarEvent):
                raise self._error("E-YAML-013", event, "a key must be a plain name, not a list or a mapping.")
            key = str(event.value)
            if key in data:
                first = self.lines[(*keys, key)]
                raise self._error(
                    "E-YAML-014",
                    event,
                    f"the key '{excerpt(key)}' stands here and on line {first}; keep one.",
                )
            self.lines[(*keys, key)] = event.start_mark.line + 1
            data[key] = self._value(self._next(), (*keys, key))
        return data

    def _scalar(self, event: ScalarEvent) -> Any:
        text = str(event.value)
        if event.style:
            return text
        if text in _NULL:
            return None
        if text in _TRUTH:
            return _TRUTH[text]
        if len(text) > _LONGEST_NUMBER and (_DECIMAL.fullmatch(text) or _OTHER_BASE.fullmatch(text)):
            raise self._error(
                "E-YAML-015",
                event,
                f"a number has {len(text)} digits; write it with an exponent, such as 1e3.",
            )
        if _DECIMAL.fullmatch(text):
            return int(text)
        if _OTHER_BASE.fullmatch(text):
            return int(text, 0)
        if _FLOAT.fullmatch(text):
            return float(text)
        if _NO_NUMBER.fullmatch(text):
            return float(text.replace(".", ""))
        return text


def _too_deep(path: Path, line: int) -> InputError:
    return InputError(
        "E-YAML-009",
        f"{path} line {line}: values nest more than {DEEPEST} deep; write them with fewer brackets or indents.",
    )
