"""Elements of a URDF with their line numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np

from flexcal.errors import InputError, unreadable
from flexcal.files.transaction import MEGABYTE, open_regular
from flexcal.printable import excerpt, name_fault, quoted
from flexcal.units import LARGEST, SMALLEST

LARGEST_URDF = 16 * MEGABYTE
MOST_PARTS = 1000
"""Largest number of links, and of joints."""
_BEGINNING = 100
"""Bytes by which a file that is no XML at all is told."""
_DEEPEST = 50
_MACRO = re.compile(r"\$[{(]")
_REFERENCES = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
)
"""What an attribute's value cannot hold as it is; xml.sax.saxutils does the same and loads a client of HTTP."""


@dataclass(frozen=True)
class Element:
    """XML element of the file `path`: its tag, attributes, first `line` and children."""

    path: Path
    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """Children with this tag."""
        return (child for child in self.children if child.tag == tag)

    def find(self, tag: str) -> Element | None:
        """First child with this tag."""
        return next(self.all(tag), None)

    def mesh_names(self) -> Iterator[str]:
        """Files of the meshes in the element, as it calls them."""
        if self.tag == "mesh" and "filename" in self.attributes:
            yield self.attributes["filename"]
        for child in self.children:
            yield from child.mesh_names()

    def text(self) -> str:
        """XML text of the element with attributes and children alone: no text, comments, entities or encoding."""
        attributes = "".join(
            f' {name}="{value.translate(_REFERENCES)}"' for name, value in self.attributes.items()
        )
        inside = "".join(child.text() for child in self.children)
        return f"<{self.tag}{attributes}>{inside}</{self.tag}>" if inside else f"<{self.tag}{attributes}/>"

    def error(self, code: str, sentence: str) -> InputError:
        """`InputError` that places `sentence` at the element's line."""
        return InputError(code, f"{self.path} line {self.line}: {sentence}")

    def numbers(self, attribute: str, count: int, owner: str) -> np.ndarray:
        """The `count` finite numbers of an attribute, zero below `units.SMALLEST`; raises `InputError` naming its `owner` without them."""
        text = self.attributes.get(attribute)
        if text is None:
            raise self.error(
                "E-URDF-027", f"<{self.tag}> of {owner} lacks the attribute '{attribute}'; add it."
            )
        try:
            # other readers take neither 1_0 nor digits of other scripts
            values = np.array(
                [float(word) if word.isascii() and "_" not in word else np.nan for word in text.split()]
            )
        except ValueError:
            values = np.array([np.nan])
        if len(values) != count or not (np.abs(values) <= LARGEST).all():
            what = "a number" if count == 1 else f"{count} numbers"
            raise self.error(
                "E-URDF-028",
                f'{attribute}="{excerpt(text)}" in <{self.tag}> of {owner} is not {what}; write {what} with decimal points.',
            )
        return np.where(np.abs(values) < SMALLEST, 0.0, values)


def xacro_error(path: Path, what: str = ": this") -> InputError:
    """Error of a file that xacro has to expand before it is a URDF; `what` in it is xacro, after the file's path."""
    expanded = f"{path.stem.removesuffix('.urdf')}{'' if path.suffix == '.xacro' else '.expanded'}.urdf"
    return InputError(
        "E-URDF-033",
        f"{path}{what} is xacro, not URDF; expand it first: xacro {quoted(path.name)} > {quoted(expanded)}.",
    )


def macro_in(tag: str, attributes: Mapping[str, str], prefixes: set[str]) -> str | None:
    """What of a start tag xacro has to expand: an element or attribute of its own, a value with ${…} or $(…).

    `prefixes` are those of its namespace, to which the declarations among the attributes are added. These alone are no macro: xacro
    leaves them in what it has expanded.
    """
    declared = [name for name in attributes if name.partition(":")[0] == "xmlns"]
    prefixes.update(name.partition(":")[2] for name in declared if "xacro" in attributes[name])
    own = prefixes - {""}
    if tag.partition(":")[0] in own and ":" in tag:
        return f"<{tag}>"
    for name, value in attributes.items():
        if name in declared:
            continue
        if (":" in name and name.partition(":")[0] in own) or _MACRO.search(value):
            return f'{name}="{excerpt(value)}"'
    return None


def read_elements(path: Path) -> Element:
    """Root element of an XML file that xacro need not expand.

    Raises `InputError`, with line and column if possible, for a file that is not well-formed or has macros.
    """
    parser, beginning = expat.ParserCreate(), b""
    above: list[Element] = []
    roots: list[Element] = []
    prefixes = {"xacro"}
    counts = {"link": 0, "joint": 0}

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(path, tag, attributes, parser.CurrentLineNumber)
        macro = macro_in(tag, attributes, prefixes)
        if macro is not None:
            raise xacro_error(path, f" line {element.line}: {macro}")
        if len(above) > _DEEPEST:
            raise element.error(
                "E-URDF-029",
                f"elements nest more than {_DEEPEST} deep, so this is no URDF; name the robot's URDF.",
            )
        if fault := name_fault(attributes.get("name", "")):
            raise element.error(
                "E-URDF-045",
                f"the name '{excerpt(attributes['name'])}' of a <{tag}> holds the character {fault}, which no name may; rename it.",
            )
        siblings = above[-1].children if above else roots
        if len(above) == 1 and tag in ("link", "joint"):
            counts[tag] += 1
            if counts[tag] > MOST_PARTS:
                raise element.error(
                    "E-URDF-046",
                    f"there are more than {MOST_PARTS} elements <{tag}>, which no robot has; name the robot's URDF.",
                )
        siblings.append(element)
        above.append(element)

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda tag: above.pop()
    try:
        with open_regular(path, limit=LARGEST_URDF) as stream:
            beginning = stream.peek(_BEGINNING)
            parser.ParseFile(stream)
    except OSError as problem:
        raise unreadable(path, problem, "check the file") from problem
    except expat.ExpatError as problem:
        if not beginning.lstrip(b"\xef\xbb\xbf\xff\xfe\x00 \t\r\n").startswith(b"<"):
            raise InputError(
                "E-URDF-030", f"{path}: this is no XML, so no URDF; name the robot's URDF."
            ) from problem
        raise InputError(
            "E-URDF-031",
            f"{path} line {problem.lineno}, column {problem.offset + 1}: not well-formed XML "
            f"({expat.ErrorString(problem.code)}); correct it there.",
        ) from problem
    except (ValueError, LookupError) as problem:
        raise InputError(
            "E-URDF-032", f"{path} line 1: its encoding is not supported ({problem}); save it as UTF-8."
        ) from problem
    return roots[0]
