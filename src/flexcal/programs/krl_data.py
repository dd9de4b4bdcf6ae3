"""Data of KRL modules: what is declared where, with its value, and whether the program changes it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from lark import Tree

from flexcal.programs.program import ProgramFile, Written
from flexcal.programs.syntax import (
    Node,
    Statement,
    between_commas,
    is_token,
    is_tree,
    name_of,
    written_number,
)

_TYPES = ("e6pos", "pos", "frame", "axis", "e6axis", "fdat", "load")
_ALIASES = 8
"""Longest chain of variables that are set to one another."""


def statements_of(nodes: Sequence[Node], file: int) -> Iterator[Statement]:
    """Lines of a file."""
    part: list[Node] = []
    routine = ""
    for node in [*nodes, None]:
        if node is not None and not is_token(node, "NEWLINE"):
            part.append(node)
            continue
        if part:
            names = [name_of(each) for each in part]
            header = [k for k, name in enumerate(names) if name in ("def", "deffct")]
            if header and (later := [name for name in names[header[0] + 1 :] if name]):
                routine = later[0] if names[header[0]] == "def" else later[-1]
            yield Statement(part, file, routine)
        part = []


def components(node: Node) -> dict[str, list[Node]]:
    """Values of {NAME value, …} by name in lower case, without the type that stands before a colon."""
    if not is_tree(node, "aggregate") or not isinstance(node, Tree):
        return {}
    found = {}
    for part in between_commas(node.children):
        colon = next((k for k, each in enumerate(part) if each == ":"), -1)
        rest = part[colon + 1 :]
        if len(rest) > 1 and name_of(rest[0]):
            found[name_of(rest[0])] = rest[1:]
    return found


def numbers_of(node: Node, file: int, names: Sequence[str]) -> tuple[Written, ...] | None:
    """Numbers of the components of these names; None where one is missing or no number."""
    parts = components(node)
    found = [written_number(parts.get(name, []), file) for name in names]
    return tuple(number for number in found if number is not None) if all(found) else None


@dataclass
class Variable:
    """A variable or an element of an array with one number: the module that it is of, and the values that it is given in the text."""

    file: int
    values: list[Node | None] = field(default_factory=list)

    @property
    def value(self) -> Node | None:
        """The value where there is just one; None where the program sets another, or what is none in the text."""
        return self.values[0] if len(self.values) == 1 else None


@dataclass
class KrlData:
    """Variables by module (stem of the file, in lower case) and name, which has its index behind it as name[1]."""

    files: Sequence[ProgramFile]
    known: dict[tuple[str, str], Variable] = field(default_factory=dict)

    @classmethod
    def of(cls, files: Sequence[ProgramFile], statements: Sequence[Statement]) -> KrlData:
        """Declarations and assignments of the lines: data lists first, then programs."""
        data = cls(files)
        for statement in sorted(statements, key=lambda statement: not is_list(files[statement.file])):
            data._note(statement)
        return data

    def module(self, file: int) -> str:
        """Module of a file."""
        return Path(self.files[file].name).stem.lower()

    def find(self, name: str, file: int) -> Variable | None:
        """Variable of a name where it is used: of the module, else the one of another."""
        own = self.known.get((self.module(file), name))
        if own is not None:
            return own
        others = [variable for (_, known), variable in self.known.items() if known == name]
        return others[0] if len(others) == 1 else None

    def value(self, nodes: Sequence[Node], file: int) -> tuple[Node, int] | None:
        """Brackets {…} that an expression is, or that the one value of its variable is, and the index of their file."""
        for _ in range(_ALIASES):
            if len(nodes) == 1 and is_tree(nodes[0], "aggregate"):
                return nodes[0], file
            name = variable_name(nodes)
            variable = self.find(name, file) if name else None
            if variable is None or variable.value is None:
                return None
            nodes, file = [variable.value], variable.file
        return None

    def _note(self, statement: Statement) -> None:
        nodes = statement.nodes
        equals = next((k for k, node in enumerate(nodes) if node == "="), None)
        if not equals:
            return
        first = equals - 1
        while first > 0 and (not name_of(nodes[first]) or nodes[first - 1] == "."):
            first -= 1
        whole = all(node != "." for node in nodes[first:equals])
        name = variable_name(nodes[first:equals]) if whole else name_of(nodes[first])
        if not name:
            # an element whose index is computed, of which all elements may change
            stem = name_of(nodes[first]) + "["
            for (_, known), variable in self.known.items():
                if known.startswith(stem):
                    variable.values.append(None)
            return
        variable = self.find(name, statement.file)
        declared = is_list(self.files[statement.file]) or any(
            name_of(node) in _TYPES for node in nodes[:first]
        )
        if variable is None or (declared and variable.file != statement.file):
            variable = self.known.setdefault((self.module(statement.file), name), Variable(statement.file))
        if not variable.values:
            variable.file = statement.file
        rest = nodes[equals + 1 :]
        alias = len(rest) == 1 and (is_tree(rest[0], "aggregate") or bool(name_of(rest[0])))
        variable.values.append(rest[0] if whole and alias else None)


def variable_name(nodes: Sequence[Node]) -> str:
    """Name of a variable, with its index where that is a number; empty where the nodes are something else."""
    if len(nodes) == 1:
        return name_of(nodes[0])
    if len(nodes) == 2 and name_of(nodes[0]) and is_tree(nodes[1], "index") and isinstance(nodes[1], Tree):
        index = written_number(nodes[1].children, 0)
        return "" if index is None else f"{name_of(nodes[0])}[{int(index.value)}]"
    return ""


def is_list(file: ProgramFile) -> bool:
    """Whether a file is a data list."""
    return file.name.lower().endswith(".dat")
