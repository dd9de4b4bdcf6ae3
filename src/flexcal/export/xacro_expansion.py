"""Expansion of xacro files, with the place in the sources from which every element comes."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.dom import minidom

from flexcal.errors import FlexcalError, InputError, unreadable
from flexcal.export.xml_text import MARK, XmlText, read_xml_text

XACRO = "http://www.ros.org/wiki/xacro"
_MANIFEST = "package.xml"


@dataclass(eq=False)
class ExpandedElement:
    """Element of the expanded description; `place` is the file and the element in it from which it comes, None where xacro made it."""

    tag: str
    attributes: dict[str, str]
    place: tuple[Path, int] | None
    parent: ExpandedElement | None
    text: str = ""
    children: list[ExpandedElement] = field(default_factory=list)

    def find(self, tag: str) -> ExpandedElement | None:
        """First child with this tag."""
        return next((child for child in self.children if child.tag == tag), None)

    def walk(self) -> Iterator[ExpandedElement]:
        """The element and all in it, in the order of the file."""
        yield self
        for child in self.children:
            yield from child.walk()


@dataclass(frozen=True, eq=False)
class Expansion:
    """Expanded description: its `root`, its plain `text`, and all files read, with their content; XML files with their elements too.

    The first file is the main one. `packages` are the folders of ROS packages that were looked up.
    """

    root: ExpandedElement
    text: str
    contents: Mapping[Path, bytes]
    sources: Mapping[Path, XmlText]
    packages: frozenset[Path]


@dataclass(frozen=True, eq=False)
class XacroSource:
    """A xacro file or a URDF, the values of its arguments, and folders of ROS packages by name.

    A package that is not named is looked for around the file, by its package.xml or its folder's name, then where ROS has it.
    """

    path: Path
    arguments: Mapping[str, str]
    packages: Mapping[str, Path]

    def expand(self, replaced: Mapping[Path, bytes]) -> Expansion:
        """The description, with the files `replaced` having other content.

        Raises `InputError` where a file is missing or not well-formed, where xacro refuses it, and where xacro is needed and absent.
        """
        main = Path(os.path.abspath(self.path))
        reading = _Reading(replaced, main.parent, self.path.parent)
        first = reading.first(main)
        macros = _has_macros(first)
        document: Any = self._processed(main, reading) if macros else minidom.parseString(first.marked(0))
        root = _element(document.documentElement, list(reading.sources), None)
        for node in _elements(document.documentElement):
            if node.hasAttribute(MARK):
                node.removeAttribute(MARK)
        return Expansion(
            root, document.toxml(), reading.contents, reading.sources, frozenset(reading.packages)
        )

    def _processed(self, main: Path, reading: _Reading) -> Any:
        try:
            import xacro
            from xacro import substitution_args
        except ImportError:
            raise InputError("E-ROS-003", f"{self.path}: macros need xacro: pip install xacro.") from None
        finds = substitution_args._eval_find
        setattr(xacro, "open", reading.open)  # noqa: B010 - the name that hides Python's own there

        def find(package: str) -> str:
            folder = self._package(package, finds)
            reading.packages.add(folder)
            return str(folder)

        substitution_args._eval_find = find
        try:
            with contextlib.redirect_stderr(io.StringIO()):
                return xacro.process_file(str(main), mappings=dict(self.arguments), verbosity=0)
        except FlexcalError:
            raise
        except Exception as problem:  # whatever an expression in a foreign file may raise
            below = getattr(problem, "exc", None)
            if isinstance(below, FlexcalError):
                raise below from problem
            last = Path((xacro.filestack or [str(main)])[-1] or main)
            reason = " ".join(str(problem).split()) or type(problem).__name__
            raise InputError(
                "E-ROS-004",
                f"{last}: xacro cannot expand it ({reason[:200]}); give its arguments with --arguments NAME:=VALUE and folders of packages "
                "with --packages NAME=FOLDER.",
            ) from problem
        finally:
            delattr(xacro, "open")
            substitution_args._eval_find = finds

    def _package(self, name: str, installed: Any) -> Path:
        if name in self.packages:
            return self.packages[name].absolute()
        for folder in Path(os.path.abspath(self.path)).parents:
            for near in (folder, folder / name):
                manifest = near / _MANIFEST
                if manifest.is_file() and (
                    near.name == name or f"<name>{name}</name>" in manifest.read_text("utf-8")
                ):
                    return near
        try:
            return Path(installed(name))
        except Exception:
            raise InputError(
                "E-ROS-005",
                f"{self.path}: the package '{name}' is not found; say where it is: --packages {name}=FOLDER.",
            ) from None


class _Reading:
    """Files as xacro reads them, with marks in the XML ones."""

    def __init__(self, replaced: Mapping[Path, bytes], folder: Path, shown: Path) -> None:
        self.replaced, self.folder, self.shown = replaced, folder, shown
        self.contents: dict[Path, bytes] = {}
        self.sources: dict[Path, XmlText] = {}
        self.packages: set[Path] = set()

    def first(self, path: Path) -> XmlText:
        """The main file, which must be XML; raises `InputError` if it cannot be read."""
        try:
            content = self._content(path)
        except OSError as problem:
            raise unreadable(self._shown(path), problem) from problem
        self.contents[path] = content
        self.sources[path] = read_xml_text(self._shown(path), content)
        return self.sources[path]

    def open(self, name: str) -> io.StringIO:
        """In place of xacro's `open`; raises `OSError` as that does, for includes that may be missing."""
        path = Path(os.path.abspath(name))
        if path not in self.contents:
            content = self.contents[path] = self._content(path)
            if content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
                self.sources[path] = read_xml_text(self._shown(path), content)
        if path in self.sources:
            number = list(self.sources).index(path)
            return io.StringIO(self.sources[path].marked(number).decode("utf-8-sig"))
        return io.StringIO(self.contents[path].decode("utf-8"))

    def _content(self, path: Path) -> bytes:
        return self.replaced[path] if path in self.replaced else path.read_bytes()

    def _shown(self, path: Path) -> Path:
        """A file as messages name it."""
        return self.shown / path.relative_to(self.folder) if path.is_relative_to(self.folder) else path


def _has_macros(text: XmlText) -> bool:
    root = text.elements[0]
    return any(
        name.startswith("xmlns:") and "xacro" in place.value for name, place in root.attributes.items()
    )


def _element(node: Any, files: list[Path], parent: ExpandedElement | None) -> ExpandedElement:
    attributes = {key: value for key, value in node.attributes.items()}
    mark = attributes.pop(MARK, None)
    place = None
    if mark is not None:
        number, index = mark.split()
        place = (files[int(number)], int(index))
    said = "".join(child.data for child in node.childNodes if child.nodeType == node.TEXT_NODE).strip()
    element = ExpandedElement(node.tagName, attributes, place, parent, said)
    element.children = [
        _element(child, files, element) for child in node.childNodes if child.nodeType == node.ELEMENT_NODE
    ]
    return element


def _elements(node: Any) -> Iterator[Any]:
    yield node
    for child in node.childNodes:
        if child.nodeType == node.ELEMENT_NODE:
            yield from _elements(child)
