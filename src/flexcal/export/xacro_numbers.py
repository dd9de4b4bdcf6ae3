"""Numbers that xacro files define by name, and which number of the expanded description each of them makes.

What a definition makes is not read from expressions but measured: with another value the description is expanded again.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from flexcal.errors import InputError
from flexcal.export.wanted_numbers import EXACT, number_text
from flexcal.export.xacro_expansion import ExpandedElement, Expansion
from flexcal.export.xml_text import Edit, XmlText

_NUMBER = re.compile(r"(?<!\S)[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?!\S)")
_DEFAULT = re.compile(r"(?<==)[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?!\S)")
_BUILT_IN = (
    "if",
    "unless",
    "include",
    "macro",
    "insert_block",
    "property",
    "arg",
    "element",
    "attribute",
    "call",
)
_MOST_VALUES = 100_000
"""Largest number of values of a YAML file."""
_STEP = 2.0**-10
"""Change of a definition by which what it makes is measured."""
_SAME = 1e-9
_LEAST_SLOPE, _LARGEST_SLOPE = 1e-4, 1 + 1e-6


@dataclass(frozen=True)
class Definition:
    """A number in the text of a file that has a name there: its value, the bytes `first` to `end`, and its line."""

    path: Path
    name: str
    value: float
    first: int
    end: int
    line: int

    def edit(self, value: float) -> Edit:
        """The definition with another value."""
        return Edit(self.path, self.first, self.end, number_text(value))


@dataclass(frozen=True)
class Spot:
    """A number of the expanded description: which element in the order of the file, attribute (None: text), and word of it."""

    element: int
    attribute: str | None
    word: int


Expand = Callable[[Sequence[Edit]], Expansion]


def definitions(expansion: Expansion) -> Iterator[Definition]:
    """Numbers of properties, arguments, macro parameters and YAML files of a description."""
    for path, content in expansion.contents.items():
        if path in expansion.sources:
            yield from _of_xml(path, expansion.sources[path])
        else:
            yield from _of_yaml(path, content)


def yaml_numbers(path: Path, content: bytes) -> Iterator[tuple[tuple[str, ...], Definition]]:
    """Keys and numbers of the mappings of a YAML file; raises `InputError` with its line where it is none."""
    text = content.decode("utf-8", "replace")
    bytes_before = range(len(text) + 1)
    if not text.isascii():
        bytes_before = [0, *itertools.accumulate(len(letter.encode()) for letter in text)]
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except (yaml.YAMLError, RecursionError) as problem:
        mark = getattr(problem, "problem_mark", None)
        at = "" if mark is None else f" line {mark.line + 1}"
        raise InputError(
            "E-ROS-006", f"{path}{at}: this is no YAML ({getattr(problem, 'problem', '')}); correct it."
        ) from None
    waiting: list[tuple[tuple[str, ...], yaml.Node]] = [] if root is None else [((), root)]
    count = 0
    while waiting:
        keys, node = waiting.pop()
        count += 1
        if count > _MOST_VALUES:  # aliases repeat values
            raise InputError(
                "E-ROS-043", f"{path}: it has more than {_MOST_VALUES} values; leave out others than limits."
            )
        if isinstance(node, yaml.MappingNode):
            waiting += [((*keys, str(key.value)), value) for key, value in node.value]
        elif isinstance(node, yaml.ScalarNode) and (value := _number(node.value)) is not None:
            end = bytes_before[node.end_mark.index]
            first = end - len(node.value.encode())
            if content[first:end].decode("utf-8", "replace") == node.value:
                name = ".".join(keys)
                yield keys, Definition(path, name, value, first, end, node.start_mark.line + 1)


def differences(
    before: Sequence[ExpandedElement], after: Sequence[ExpandedElement]
) -> dict[Spot, tuple[float, float]] | None:
    """Numbers that differ between two expansions of the same elements; None where anything else differs."""
    if len(before) != len(after):
        return None
    found: dict[Spot, tuple[float, float]] = {}
    for k, (one, other) in enumerate(zip(before, after, strict=True)):
        if one.tag != other.tag or one.attributes.keys() != other.attributes.keys():
            return None
        texts = [(name, value, other.attributes[name]) for name, value in one.attributes.items()]
        for name, old, new in (*texts, (None, one.text, other.text)):
            if old == new:
                continue
            words = list(zip(old.split(), new.split(), strict=False))
            if len(old.split()) != len(new.split()):
                return None
            for word, (first, second) in enumerate(words):
                if first != second:
                    numbers = _number(first), _number(second)
                    if numbers[0] is None or numbers[1] is None:
                        return None
                    found[Spot(k, name, word)] = (numbers[0], numbers[1])
    return found


class Makers:
    """Definitions that make one number of the description and nothing else."""

    def __init__(self, expansion: Expansion, expand: Expand) -> None:
        self._before, self._expand = list(expansion.root.walk()), expand
        self._definitions = tuple(definitions(expansion))
        self._made: dict[Definition, dict[Spot, tuple[float, float]] | None] = {}

    def edit(
        self, spot: Spot, value: float, wanted: float, names: set[str]
    ) -> tuple[Definition, Edit] | None:
        """The definition of the number at `spot`, now `value`, with the value that makes it `wanted`; None where none makes it alone.

        Tried are definitions of that size, also in degrees, and those with one of the `names`, unless they are a unit or a scale: a power
        of ten, or what is multiplied by more than one.
        """
        for definition in self._definitions:
            sizes = (abs(definition.value), math.radians(abs(definition.value)))
            alike = any(abs(size - abs(value)) <= _SAME for size in sizes)
            if not alike and (definition.name not in names or _is_unit(definition.value)):
                continue
            made = self._effect(definition)
            if made is None or set(made) != {spot}:
                continue
            slope = (made[spot][1] - made[spot][0]) / _STEP
            if not _LEAST_SLOPE < abs(slope) < _LARGEST_SLOPE:
                continue
            edit = definition.edit(definition.value + (wanted - value) / slope)
            after = self._changes([edit])
            if after is not None and set(after) == {spot} and abs(after[spot][1] - wanted) <= EXACT:
                return definition, edit
        return None

    def _effect(self, definition: Definition) -> dict[Spot, tuple[float, float]] | None:
        if definition not in self._made:
            self._made[definition] = self._changes([definition.edit(definition.value + _STEP)])
        return self._made[definition]

    def _changes(self, edits: Sequence[Edit]) -> dict[Spot, tuple[float, float]] | None:
        try:
            return differences(self._before, list(self._expand(edits).root.walk()))
        except InputError:  # the number is a switch or a count
            return None


def _of_xml(path: Path, source: XmlText) -> Iterator[Definition]:
    for element in source.elements:
        tag = element.tag.removeprefix("xacro:")
        if tag == element.tag:
            continue
        for attribute, place in element.attributes.items():
            pattern = _NUMBER
            if tag == "macro" and attribute == "params":
                pattern = _DEFAULT
            elif tag in _BUILT_IN and (tag, attribute) not in (
                ("property", "value"),
                ("property", "default"),
                ("arg", "default"),
            ):
                continue
            name = (
                element.attributes["name"].value
                if tag in ("property", "arg") and "name" in element.attributes
                else attribute
            )
            text = source.content[place.first : place.end].decode()
            for found in pattern.finditer(text):
                first, end = (place.first + len(text[:at].encode()) for at in found.span())
                own = text[: found.start()].split()[-1].rstrip(":=^|") if pattern is _DEFAULT else name
                yield Definition(path, own, float(found.group()), first, end, element.line)


def _of_yaml(path: Path, content: bytes) -> Iterator[Definition]:
    for _, definition in yaml_numbers(path, content):
        yield definition


def _is_unit(value: float) -> bool:
    return value > 0 and math.log10(value).is_integer()


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def names_in(text: str, texts: Mapping[str, str]) -> set[str]:
    """Names in an expression, and in those of the names in it; `texts` has the expressions of properties and parameters by name."""
    found: set[str] = set()
    waiting = set(re.findall(r"[^\W\d]\w*", text))
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting |= set(re.findall(r"[^\W\d]\w*", texts.get(name, "")))
    return found
