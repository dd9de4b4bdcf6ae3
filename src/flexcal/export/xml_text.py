"""XML files with the places of their elements and attributes, so that single numbers can be replaced in the bytes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

from flexcal.errors import InputError

_MOST_ELEMENTS = 100_000
"""Largest number of elements and attributes of a file."""
_ATTRIBUTE = re.compile(rb"""\s+([^\s=<>/"']+)\s*=\s*(?:"([^"]*)"|'([^']*)')""")
_SPACE = re.compile(rb"\s*")


@dataclass(frozen=True)
class Edit:
    """Bytes `first` to `end` of a file, and the text that takes their place."""

    path: Path
    first: int
    end: int
    text: str


@dataclass(frozen=True)
class Place:
    """Value of an attribute, as parsed, and the first byte of its text between the quotes and the one after its last."""

    value: str
    first: int
    end: int


@dataclass(eq=False)
class SourceElement:
    """Element of an XML file: its tag, line, attributes with their places, and the element around it.

    `named` is the byte after the tag's name, `attributed` that after the last attribute, `opened` that after the start tag, and `closed`
    the first of the end tag; `text` is what stands directly in it.
    """

    tag: str
    line: int
    attributes: dict[str, Place]
    parent: SourceElement | None
    named: int
    attributed: int
    opened: int
    closed: int = 0
    text: str = ""
    children: list[SourceElement] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class XmlText:
    """Bytes of an XML file, and its elements in their order; the first is the root."""

    path: Path
    content: bytes
    elements: tuple[SourceElement, ...]

    def indent(self, element: SourceElement) -> str:
        """White space between the start tag of an element and its first child."""
        found = _SPACE.match(self.content, element.opened)
        assert found is not None
        return found.group().decode()

    def where(self, element: SourceElement) -> str:
        """File and line of an element."""
        return f"{self.path} line {element.line}"


def read_xml_text(path: Path, content: bytes) -> XmlText:
    """Elements of an XML file in UTF-8; raises `InputError` with the line where it is not well-formed."""
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text, parser.buffer_size = True, 2**20
    count = 0
    elements: list[SourceElement] = []
    above: list[SourceElement] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1 + len(attributes)
        if count > _MOST_ELEMENTS:
            raise InputError(
                "E-ROS-039",
                f"{path}: it has more than {_MOST_ELEMENTS:,} elements and attributes, which no robot needs; name the robot's description.",
            )
        at = parser.CurrentByteIndex + 1 + len(tag.encode())
        places, end = {}, at
        while found := _ATTRIBUTE.match(content, end):
            name, end = found.group(1).decode(), found.end()
            group = 2 if found.group(2) is not None else 3
            places[name] = Place(attributes.get(name, ""), *found.span(group))
        close = content.index(b">", end) + 1
        element = SourceElement(
            tag, parser.CurrentLineNumber, places, above[-1] if above else None, at, end, close
        )
        if above:
            above[-1].children.append(element)
        elements.append(element)
        above.append(element)

    def end(tag: str) -> None:
        above.pop().closed = parser.CurrentByteIndex

    def text(said: str) -> None:
        above[-1].text += said

    def refuse_entities(*_: object) -> None:
        raise InputError(
            "E-ROS-040",
            f"{path} line {parser.CurrentLineNumber}: <!DOCTYPE> is not read in a description; write what its entities stand for.",
        )

    parser.StartDoctypeDeclHandler = refuse_entities
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = text
    try:
        content.decode("utf-8")
        parser.Parse(content, True)
    except expat.ExpatError as problem:
        raise InputError(
            "E-ROS-001",
            f"{path} line {problem.lineno}, column {problem.offset + 1}: not well-formed XML "
            f"({expat.ErrorString(problem.code)}); correct it there.",
        ) from problem
    except UnicodeDecodeError as problem:
        line = content[: problem.start].count(b"\n") + 1
        raise InputError(
            "E-ROS-002", f"{path} line {line}: this is not UTF-8; save the file as UTF-8."
        ) from None
    return XmlText(path, content, tuple(elements))


def attribute_text(value: str) -> str:
    """A value as it stands between double quotes."""
    return escape(value, {'"': "&quot;"})


def new_element(tag: str, attributes: Mapping[str, str], text: str = "") -> str:
    """An element as text."""
    given = "".join(f" {name}={quoteattr(value)}" for name, value in attributes.items())
    return f"<{tag}{given}>{escape(text)}</{tag}>" if text else f"<{tag}{given}/>"


def edited(contents: Mapping[Path, bytes], edits: Iterable[Edit]) -> dict[Path, bytes]:
    """Contents of the files that edits change; all other bytes are kept."""
    result: dict[Path, bytes] = {}
    for edit in sorted(edits, key=lambda edit: (edit.path, edit.first), reverse=True):
        content = result.get(edit.path, contents[edit.path])
        result[edit.path] = content[: edit.first] + edit.text.encode() + content[edit.end :]
    return result
