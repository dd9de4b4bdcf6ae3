"""Overlay of a description: a YAML file with numbers by the names of joints and links, and the expressions that look them up."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path

from flexcal.export.xacro_expansion import XACRO
from flexcal.export.xml_text import Edit, XmlText, new_element

_PROPERTY = "calibrated"
_PIECE = re.compile(r"\$\{([^}]*)\}|\$\(([^)]*)\)|([^$]+)")


class Overlay:
    """Overlay beside the main file of a description, with the entries that are added, and the files that look them up."""

    def __init__(self, contents: Mapping[Path, bytes]) -> None:
        main = next(iter(contents))
        self.path = main.with_name(f"{main.name.split('.')[0]}.calibration.yaml")
        self._title = main.name
        self._property = _PROPERTY
        while any(f'"{self._property}"'.encode() in content for content in contents.values()):
            self._property += "_"
        self._entries: dict[str, dict[str, dict[str, str]]] = {"joints": {}, "links": {}}
        self._readers: dict[Path, XmlText] = {}

    def add(self, kind: str, name: str, key: str, value: str) -> None:
        """Give a joint or link (`kind` is its tag) a value."""
        self._entries[f"{kind}s"].setdefault(name, {})[key] = value

    def expression(self, path: Path, source: XmlText, kind: str, name: str, key: str) -> str:
        """Expression in a file for the value of the joint or link whose name the expression `name` gives."""
        self._readers[path] = source
        return f"${{{self._property}['{kind}s'][{name}]['{key}']}}"

    def edits(self) -> list[Edit]:
        """Lines that read the overlay, in every file that looks something up."""
        edits = []
        for path, source in self._readers.items():
            root = source.elements[0]
            namespace = {} if "xmlns:xacro" in root.attributes else {"xmlns:xacro": XACRO}
            value = f"${{xacro.load_yaml('{os.path.relpath(self.path, path.parent)}')}}"
            given = {"name": self._property, "value": value, "scope": "global", **namespace}
            space = source.indent(root).rpartition("\n")[2]
            edits.append(
                Edit(path, root.opened, root.opened, f"\n{space}{new_element('xacro:property', given)}")
            )
        return edits

    @property
    def count(self) -> int:
        """Number of joints and links with entries."""
        return sum(len(entries) for entries in self._entries.values())

    def content(self) -> bytes:
        """The file."""
        lines = [
            f"# Calibrated numbers of {self._title}, written by flexcal; the xacro files look them up by name."
        ]
        for kind, entries in self._entries.items():
            lines += [f"{kind}:"] if entries else []
            for name, values in entries.items():
                lines.append(f"  {json.dumps(name)}:")
                lines += [f"    {key}: {json.dumps(value)}" for key, value in values.items()]
        return "".join(f"{line}\n" for line in lines).encode()


def name_expression(name: str) -> str | None:
    """The name of a joint or link, as written, as an expression; None where it is none."""
    parts, at = [], 0
    for piece in _PIECE.finditer(name):
        if piece.start() != at:
            return None
        at = piece.end()
        inside, extension, text = piece.groups()
        if inside is not None:
            parts.append(f"str({inside.strip()})")
        elif extension is not None:
            words = extension.split()
            if len(words) != 2 or words[0] != "arg":
                return None
            parts.append(f"str(xacro.arg('{words[1]}'))")
        else:
            parts.append(repr(text))
    return " + ".join(parts) if at == len(name) and parts else None
