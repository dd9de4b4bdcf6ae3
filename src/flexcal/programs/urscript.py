"""Targets of a URScript program (Universal Robots)."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

from lark import Token, Tree

from flexcal.errors import InputError
from flexcal.programs.dialect import Dialect
from flexcal.programs.notation import Notation
from flexcal.programs.orientation import RotationVector
from flexcal.programs.program import Divisible, Program, ProgramFile, ProgramTarget, Span, Written
from flexcal.programs.syntax import Node, end_of, parse_text, start_of
from flexcal.programs.target_list import RUN_TIME, TargetList

_MOTIONS = {"movej": 1, "movel": 1, "movep": 1, "movec": 2, "servoj": 1, "servoc": 1}
"""Motions, and how many of their first arguments are targets."""
_STRAIGHT = ("movel", "movep", "movec", "servoc")
_DIVIDED = ("movel", "movep")
_PAYLOADS = ("set_payload", "set_target_payload", "set_payload_mass")
_AXES = 6


def parse_urscript(text: str, source: str = "the program") -> Program:
    """Find the targets of a URScript program that are written as numbers, in the order of the text.

    A target is six numbers, as p[…] or as joint positions in […], in a motion or in a variable that one assignment sets; `d2r` of a
    number counts as one. `set_tcp`, `set_payload` and `set_target_payload` hold for the motions that follow in the text.

    Parameters
    ----------
    text : str
        The program.
    source : str
        Its name in messages.

    Returns
    -------
    Program
        Targets, and the motions whose targets the controller computes.

    Raises
    ------
    InputError
        Where brackets or quotes do not close.

    Examples
    --------
    >>> program = parse_urscript("set_tcp(p[0,0,0.1,0,0,0])\\nmovel(p[-0.4,0.1,0.3,0,3.14,0], v=0.2)\\nmovel(pose_add(a, b))")
    >>> program.targets[0].values, program.targets[0].tool.position.tolist()
    ((-0.4, 0.1, 0.3, 0.0, 3.14, 0.0), [0.0, 0.0, 0.1])
    >>> program.computed[0].reason
    'the controller computes it when the program runs'
    """
    return _Reader(text, source, parse_text(ProgramFile(source, text), "urscript")).program()


@dataclass
class _Reader:
    """Walk through a program in the order of its text, with the tool and the payload that hold there."""

    text: str
    source: str
    nodes: list[Node]
    tool: tuple[float, ...] | None = None
    payload: float | None = None
    tools: list[tuple[float, ...] | None] = field(default_factory=list)
    variables: dict[str, list[Node]] = field(default_factory=lambda: defaultdict(list))
    found: TargetList = field(default_factory=TargetList)

    def program(self) -> Program:
        """The program that was read."""
        self._assignments(self.nodes)
        self._walk(self.nodes)
        remarks = ()
        if len(set(self.tools)) > 1:
            remarks = (
                "the program sets several tools (set_tcp); each holds for the motions after it in the text, also where threads or "
                "functions are run in another order",
            )
        return self.found.program(URSCRIPT, (ProgramFile(self.source, self.text),), self.variables, remarks)

    def _assignments(self, nodes: Sequence[Node]) -> None:
        """Note what is assigned to every variable, wherever it is."""
        for k, node in enumerate(nodes):
            if isinstance(node, Tree):
                self._assignments(node.children)
                if k and _is(nodes[k - 1], "NAME") and nodes[k - 1] == "def" and node.data == "call":
                    # parameters of a function hide variables of these names
                    for inner in node.children[1:]:
                        if _is(inner, "NAME"):
                            self.variables[str(inner)] += [inner, inner]
            elif node == "=" and k and not (k + 1 < len(nodes) and nodes[k + 1] == "="):
                if _is(nodes[k - 1], "NAME"):
                    value = nodes[k + 1] if k + 1 < len(nodes) and _ends(nodes, k + 2) else node
                    self.variables[str(nodes[k - 1])].append(value)
                elif k > 1 and isinstance(nodes[k - 1], Tree) and _is(nodes[k - 2], "NAME"):
                    # one of its numbers is set
                    self.variables[str(nodes[k - 2])].append(node)

    def _walk(self, nodes: Sequence[Node]) -> None:
        for node in nodes:
            if not isinstance(node, Tree):
                if node in ("def", "thread"):
                    self.found.interrupt()
                continue
            if node.data == "call":
                name, arguments = str(node.children[0]), _arguments(node.children[1:])
                if name in _MOTIONS:
                    self.found.begin(
                        _MOTIONS[name],
                        straight=name in _STRAIGHT,
                        divisible=_divisible(node, arguments) if name in _DIVIDED else None,
                    )
                    for argument in arguments[: _MOTIONS[name]]:
                        self._target(name, node, argument)
                elif name == "set_tcp":
                    self.tool = _values(self._pointed(arguments[0])) if arguments else None
                    self.tools.append(self.tool)
                elif name in _PAYLOADS and arguments:
                    number = _numbers(arguments[0])
                    self.payload = number[0].value if number is not None and len(number) == 1 else None
            self._walk(node.children)

    def _pointed(self, argument: Sequence[Node]) -> Tree | None:
        """List or pose that an argument is, or that the one assignment to its variable is."""
        if len(argument) != 1:
            return None
        node = argument[0]
        if _is(node, "NAME"):
            known = self.variables.get(str(node), [])
            node = known[0] if len(known) == 1 else node
        return node if isinstance(node, Tree) and node.data in ("pose", "list") else None

    def _target(self, motion: str, call: Tree, argument: Sequence[Node]) -> None:
        """Note a target of a motion, or that the controller computes it."""
        near = None
        if len(argument) == 1 and isinstance(argument[0], Tree) and argument[0].data == "call":
            inner = argument[0]
            if inner.children[0] == "get_inverse_kin" and (given := _arguments(inner.children[1:])):
                first, *others = given
                argument = first
                seeds = [
                    other
                    for other in others
                    if not _is(other[0], "NAME") or other[0] == "qnear" or len(other) == 1
                ]
                near = self._near(seeds[0]) if seeds else None
        node = self._pointed(argument)
        numbers = None if node is None else _numbers_of(node)
        if node is None or numbers is None or len(numbers) != _AXES:
            self.found.leave(_line(call), self._said(call), self._why(argument))
            return
        name = str(argument[0]) if _is(argument[0], "NAME") else motion
        target = ProgramTarget(
            name,
            _line(node),
            node.data == "list",
            tuple(numbers),
            near,
            None if self.tool is None else URSCRIPT.notation.pose(self.tool),
            "the program sets no tool before it (set_tcp): give --tool",
            self.payload,
            motion,
            motion in _STRAIGHT,
            literal=Span(start_of(node), end_of(node)),
        )
        self.found.add(target)

    def _near(self, argument: Sequence[Node]) -> tuple[float, ...] | None:
        if len(argument) > 2 and argument[0] == "qnear":
            argument = argument[2:]
        return _values(self._pointed(argument))

    def _why(self, argument: Sequence[Node]) -> str:
        if len(argument) == 1 and _is(argument[0], "NAME"):
            known = self.variables.get(str(argument[0]), [])
            if len(known) > 1:
                return f"{argument[0]} is set more than once, so its numbers depend on how the program runs"
            if not known:
                return f"{argument[0]} is not set in this program"
        return RUN_TIME

    def _said(self, call: Tree) -> str:
        return self.text[call.meta.start_pos : call.meta.end_pos]


def _parse(files: Sequence[ProgramFile]) -> Program:
    if len(files) > 1:
        raise InputError(
            "E-PROG-006",
            f"a URScript program is one file, and {len(files)} are given; give {files[0].name} alone, and the others after it.",
        )
    return parse_urscript(files[0].text, files[0].name)


URSCRIPT = Dialect(
    "URScript of Universal Robots",
    (".script", ".urscript"),
    Notation(1.0, 1.0, RotationVector(), 9),
    _parse,
    no_start="no joint positions stand before it or beside it (qnear)",
)
"""URScript: metres and radians."""


def _divisible(call: Tree, arguments: Sequence[Sequence[Node]]) -> Divisible | None:
    """A call whose first argument is a pose or a name."""
    if not arguments or len(arguments[0]) != 1:
        return None
    return Divisible(
        Span(start_of(call), end_of(call)), Span(start_of(arguments[0][0]), end_of(arguments[0][0]))
    )


def _is(node: Node, kind: str) -> bool:
    return isinstance(node, Token) and node.type == kind


def _ends(nodes: Sequence[Node], k: int) -> bool:
    """Whether a statement ends before the element of index k."""
    return k >= len(nodes) or _is(nodes[k], "NEWLINE") or _is(nodes[k], "COMMA")


def _line(node: Tree) -> int:
    return int(node.meta.line)


def _arguments(nodes: Sequence[Node]) -> list[list[Node]]:
    """Arguments between commas, without line ends and empty ones."""
    parts: list[list[Node]] = [[]]
    for node in nodes:
        if _is(node, "COMMA"):
            parts.append([])
        elif not _is(node, "NEWLINE"):
            parts[-1].append(node)
    return [part for part in parts if part]


def _values(node: Tree | None) -> tuple[float, ...] | None:
    numbers = None if node is None else _numbers_of(node)
    return None if numbers is None or len(numbers) != _AXES else tuple(number.value for number in numbers)


def _numbers_of(node: Tree) -> list[Written] | None:
    """Numbers of a list or a pose; None where an entry is none."""
    found = [_numbers(part) for part in _arguments(node.children[1:])]
    return (
        [part[0] for part in found if part is not None] if all(part is not None for part in found) else None
    )


def _numbers(part: Sequence[Node]) -> list[Written] | None:
    """The number that an argument is, with its sign, or `d2r` of one; None for anything else."""
    sign, rest = 1.0, list(part)
    if len(rest) == 2 and _is(rest[0], "OPERATOR") and rest[0] in ("-", "+"):
        sign = -1.0 if rest[0] == "-" else 1.0
        rest = rest[1:]
    if len(rest) != 1:
        return None
    node, unit = rest[0], 1.0
    if isinstance(node, Tree) and node.data == "call" and node.children[0] == "d2r":
        given = _arguments(node.children[1:])
        inner = _numbers(given[0]) if len(given) == 1 else None
        if inner is None:
            return None
        value, unit = inner[0].value, math.pi / 180
        end = node.meta.end_pos
    elif isinstance(node, Token) and node.type == "NUMBER":
        value, end = float(node), node.end_pos
    else:
        return None
    if not math.isfinite(value):
        return None
    head = part[0]
    first = head.start_pos if isinstance(head, Token) else head.meta.start_pos
    assert first is not None and end is not None
    return [Written(sign * value * unit, int(first), int(end))]
