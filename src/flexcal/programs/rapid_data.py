"""Data of RAPID modules: what is declared where, with its value, and whether the program changes it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from lark import Tree

from flexcal.programs.syntax import (
    Node,
    Statement,
    between_commas,
    is_token,
    is_tree,
    name_of,
    written_number,
)

_DECLARES = ("const", "pers", "var")
_ROUTINES = ("proc", "func", "trap")
_ENDS = ("endproc", "endfunc", "endtrap")
_SCOPES = ("local", "task")
_STARTS = (*_ROUTINES, "module", "record", *_SCOPES, *_DECLARES)
_AFTER = (*_ENDS, "endmodule", "endrecord", "then", "else", "do", "endif", "endfor", "endwhile", "endtest")
_AFTER = (*_AFTER, "error", "undo", "backward")
_ALIASES = 8
"""Longest chain of data that are declared as others."""


@dataclass
class Datum:
    """Data of one name: where it is declared, whether only there, and the values that it is given in the text."""

    file: int
    local: bool
    values: list[Node | None] = field(default_factory=list)

    @property
    def value(self) -> Node | None:
        """The value where there is just one; None where the program sets another, or what is none in the text."""
        return self.values[0] if len(self.values) == 1 else None


@dataclass
class RapidData:
    """Data of all modules by file, routine (empty for a module's own) and name."""

    known: dict[tuple[int, str, str], Datum] = field(default_factory=dict)

    @classmethod
    def of(cls, statements: Sequence[Statement]) -> RapidData:
        """Declarations and assignments of the statements."""
        data = cls()
        for statement in statements:
            data._declare(statement)
        for statement in statements:
            data._assign(statement)
        return data

    def find(self, name: str, file: int, routine: str) -> Datum | None:
        """Data of a name where it is used: of the routine, else of the module, else the one of another module that is not local there."""
        for place in ((file, routine, name), (file, "", name)):
            if place in self.known:
                return self.known[place]
        others = [
            datum
            for (other, inner, known), datum in self.known.items()
            if known == name and not inner and other != file and not datum.local
        ]
        return others[0] if len(others) == 1 else None

    def value(self, nodes: Sequence[Node], file: int, routine: str) -> tuple[Node, int] | None:
        """Brackets that an expression is, or that the one value of its variable is, and the index of their file."""
        for _ in range(_ALIASES):
            if len(nodes) == 1 and is_tree(nodes[0], "aggregate"):
                return nodes[0], file
            if len(nodes) != 1 or not (name := name_of(nodes[0])):
                return None
            datum = self.find(name, file, routine)
            if datum is None or datum.value is None:
                return None
            routine = routine if datum.file == file else ""
            nodes, file = [datum.value], datum.file
        return None

    def elements(self, array: tuple[Node, int], index: Tree) -> list[tuple[Node, int]]:
        """Elements {i} or {i, j} of an array with the indices of their files: all along a dimension whose index is no number.

        Elements may be names of data. Empty where one of them is not written, or the array has no such one.
        """
        found = [array]
        for part in between_commas(index.children):
            number, deeper = written_number(part, 0), []
            for node, file in found:
                if not isinstance(node, Tree):
                    return []
                parts = between_commas(node.children)
                if number is not None:
                    parts = parts[int(number.value) - 1 : int(number.value)] if number.value >= 1 else []
                values = [self.value(each, file, "") for each in parts]
                if not values or None in values:
                    return []
                deeper += [value for value in values if value is not None]
            found = deeper
        return found

    def _declare(self, statement: Statement) -> None:
        nodes = statement.nodes
        names = [name_of(node) for node in nodes]
        if any(name in _ROUTINES for name in names):
            for node in nodes:
                if is_tree(node, "group") and isinstance(node, Tree):
                    for part in between_commas(node.children):
                        parameter = [name for name in map(name_of, part) if name]
                        if len(parameter) > 1:
                            place = (statement.file, statement.routine, parameter[-1])
                            self.known[place] = Datum(statement.file, True, [None, None])
            return
        k = next((k for k, name in enumerate(names) if name in _DECLARES), None)
        if k is None or k + 2 >= len(nodes) or not names[k + 2]:
            return
        place = (statement.file, statement.routine, names[k + 2])
        datum = self.known.setdefault(place, Datum(statement.file, "local" in names[:k]))
        given = next((j for j, node in enumerate(nodes) if is_token(node, "ASSIGN")), None)
        if given is not None:
            datum.values.append(nodes[given + 1] if given + 2 == len(nodes) else None)

    def _assign(self, statement: Statement) -> None:
        """Note an assignment to data, or to a part of them."""
        nodes = statement.nodes
        if any(name_of(node) in _DECLARES for node in nodes):
            return
        for k, node in enumerate(nodes):
            if not is_token(node, "ASSIGN") or not k:
                continue
            first = k - 1
            while first > 0 and (not name_of(nodes[first]) or nodes[first - 1] == "."):
                first -= 1
            if first and nodes[first - 1] == "\\":
                continue
            datum = self.find(name_of(nodes[first]), statement.file, statement.routine)
            if datum is not None:
                whole = first == k - 1 and k + 2 == len(nodes)
                datum.values.append(nodes[k + 1] if whole else None)


def statements_of(nodes: Sequence[Node], file: int) -> Iterator[Statement]:
    """Statements of a file in the order of its text; headers and keywords between them are some of their own."""
    routine, part = "", []
    for node in nodes:
        name = name_of(node)
        if is_token(node, "SEMICOLON") or (name in _STARTS and not _continues(part)):
            if part:
                yield Statement(part, file, routine)
            part = []
        if not is_token(node, "SEMICOLON"):
            part.append(node)
        if name in _AFTER:
            yield Statement(part, file, routine)
            part = []
            routine = "" if name in _ENDS else routine
        header = [name_of(each) for each in part if name_of(each) not in _SCOPES]
        if header[:1] == ["trap"] and len(header) == 2:
            routine = header[1]
        elif is_tree(node, "group") and len(header) > 1 and header[0] in _ROUTINES:
            routine = header[-2]
        else:
            continue
        yield Statement(part, file, routine)
        part = []
    if part:
        yield Statement(part, file, routine)


def _continues(part: Sequence[Node]) -> bool:
    """Whether the words LOCAL and TASK stand before, which belong to what follows."""
    return bool(part) and all(name_of(node) in _SCOPES for node in part)
