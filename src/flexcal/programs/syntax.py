"""Nodes of a parsed program that dialects have in common: brackets with arguments between commas, and numbers with signs."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedInput

from flexcal.errors import FlexcalError, InputError
from flexcal.programs.program import ProgramFile, Word, Written

Node = Tree | Token
_DEEPEST = 100
"""Brackets that stand in each other at most."""


@dataclass(frozen=True)
class Statement:
    """A statement of a program: its nodes, the index of its file, and the routine that it stands in, in lower case."""

    nodes: list[Node]
    file: int
    routine: str

    @property
    def line(self) -> int:
        """Its first line."""
        return line_of(self.nodes[0])

    def text(self, files: Sequence[ProgramFile], first: int = 0) -> str:
        """Its text from the node of index `first` on, without a comment behind it."""
        return files[self.file].text[start_of(self.nodes[first]) : end_of(self.nodes[-1])]


def parse_text(file: ProgramFile, dialect: str) -> list[Node]:
    """Elements of a program's text by the grammar `dialect`.lark; raises `InputError` where brackets or quotes do not fit."""
    try:
        nodes = list(_grammar(dialect).parse(file.text).children)
    except UnexpectedInput as error:
        line = error.line if error.line > 0 else len(file.text.splitlines())
        raise InputError(
            "E-PROG-001",
            f"{file.name}, line {line}: the brackets or quotes do not fit there, so the program cannot be read; correct it.",
        ) from error
    inner = nodes
    for _ in range(_DEEPEST):
        inner = [child for node in inner if isinstance(node, Tree) for child in node.children]
    if inner:
        raise InputError(
            "E-PROG-019",
            f"{file.name}, line {line_of(inner[0])}: more than {_DEEPEST} brackets stand in each other; correct it.",
        )
    return nodes


def whole_number(text: str) -> int:
    """A number of a position, tool or frame; raises `FlexcalError` where it is none or has more than nine digits."""
    if not re.fullmatch(r"\d{1,9}", text):
        raise FlexcalError(
            "E-PROG-020", f"the number {text[:20]} is none of a position, tool or frame; correct it."
        )
    return int(text)


@cache
def _grammar(dialect: str) -> Lark:
    text = Path(__file__).with_name(f"{dialect}.lark").read_text("utf-8")
    return Lark(text, parser="lalr", propagate_positions=True)


def is_token(node: Node, kind: str) -> bool:
    """Whether a node is a token of this kind."""
    return isinstance(node, Token) and node.type == kind


def is_tree(node: Node, kind: str) -> bool:
    """Whether a node is a bracket of this kind."""
    return isinstance(node, Tree) and node.data == kind


def name_of(node: Node) -> str:
    """A name in lower case; empty where the node is none."""
    return str(node).lower() if is_token(node, "NAME") else ""


def names_in(nodes: Sequence[Node]) -> set[str]:
    """All names in the nodes and their brackets, in lower case."""
    names = {name_of(node) for node in nodes} - {""}
    for node in nodes:
        if isinstance(node, Tree):
            names |= names_in(node.children)
    return names


def line_of(node: Node) -> int:
    """Line of a node's first character."""
    line = node.line if isinstance(node, Token) else node.meta.line
    return int(line or 1)


def start_of(node: Node) -> int:
    """Index of a node's first character."""
    return int((node.start_pos if isinstance(node, Token) else node.meta.start_pos) or 0)


def end_of(node: Node) -> int:
    """Index behind a node's last character."""
    return int((node.end_pos if isinstance(node, Token) else node.meta.end_pos) or 0)


def between_commas(nodes: Sequence[Node]) -> list[list[Node]]:
    """Nodes between commas; an empty place is an empty list."""
    parts: list[list[Node]] = [[]]
    for node in nodes:
        if is_token(node, "COMMA"):
            parts.append([])
        else:
            parts[-1].append(node)
    return parts


def written_number(part: Sequence[Node], file: int) -> Written | None:
    """The finite number, with its sign, that some nodes are; None where they are something else."""
    rest = list(part)
    negative = len(rest) == 2 and is_token(rest[0], "OPERATOR") and rest[0] == "-"
    if negative or (len(rest) == 2 and rest[0] == "+"):
        rest = rest[1:]
    if len(rest) != 1 or not is_token(rest[0], "NUMBER") or not math.isfinite(float(str(rest[0]))):
        return None
    value = float(str(rest[0]))
    return Written(-value if negative else value, start_of(part[0]), end_of(rest[0]), file)


def written_numbers(node: Node, file: int) -> tuple[Written, ...] | None:
    """Numbers between the commas of a bracket; None where one is something else."""
    if not isinstance(node, Tree):
        return None
    found = [written_number(part, file) for part in between_commas(node.children)]
    return tuple(number for number in found if number is not None) if all(found) else None


def as_word(number: Written, text: str) -> Word:
    """A number of the configuration data."""
    return Word(text[number.first : number.end], number.first, number.end, number.file)
