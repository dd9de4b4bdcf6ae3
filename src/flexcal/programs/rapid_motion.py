"""Motion instructions of RAPID and their arguments (ABB: RAPID Instructions, Functions and Data types)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from flexcal.programs.program import Divisible, Span
from flexcal.programs.syntax import Node, between_commas, end_of, is_token, name_of, start_of


@dataclass(frozen=True)
class MotionKind:
    """Where the required arguments of an instruction have its `targets` and its `tool`, and what kind of target and path it has."""

    targets: tuple[int, ...]
    tool: int = -1
    joints: bool = False
    straight: bool = True


_JOINT = MotionKind((0,), straight=False)
_LINE = MotionKind((0,))
_ARC = MotionKind((0, 1))
_ABSOLUTE = MotionKind((0,), joints=True, straight=False)

KINDS = {
    "movej": _JOINT,
    "movel": _LINE,
    "movec": _ARC,
    "moveabsj": _ABSOLUTE,
    "searchl": MotionKind((2,)),
    "searchc": MotionKind((2, 3)),
    "triggj": _JOINT,
    "triggl": _LINE,
    "triggc": _ARC,
    "triggabsj": _ABSOLUTE,
    "displ": _LINE,
    "dispc": _ARC,
    "paintl": _LINE,
    "spotl": _LINE,
    "spotj": _JOINT,
    **{
        f"arc{path}{part}": kind
        for part in ("", "start", "end")
        for path, kind in (("l", _LINE), ("c", _ARC))
    },
    **{f"movej{action}": MotionKind((0,), 3, straight=False) for action in ("do", "ao", "go", "sync")},
    **{f"movel{action}": MotionKind((0,), 3) for action in ("do", "ao", "go", "sync")},
    **{f"movec{action}": MotionKind((0, 1), 4) for action in ("do", "ao", "go", "sync")},
}
"""Instructions by their names in lower case."""


@dataclass(frozen=True)
class Arguments:
    """Required arguments of an instruction, and the optional ones by name in lower case."""

    required: list[list[Node]]
    optional: dict[str, list[Node]] = field(default_factory=dict)

    @classmethod
    def of(cls, nodes: Sequence[Node]) -> Arguments:
        """Arguments between commas, with `\\Name:=value` before, between and behind them."""
        required, optional = [], {}
        for part in between_commas(nodes):
            cuts = [k for k, node in enumerate(part) if node == "\\"] + [len(part)]
            if cuts[0] > 0:
                required.append(part[: cuts[0]])
            for first, end in pairwise(cuts):
                if end > first + 1 and (name := name_of(part[first + 1])):
                    given = end > first + 2 and is_token(part[first + 2], "ASSIGN")
                    optional[name] = part[first + 3 : end] if given else []
        return cls(required, optional)


def motion_in(nodes: Sequence[Node]) -> int | None:
    """Index of the name of a motion instruction among the nodes of a statement; None where it has none."""
    for k, node in enumerate(nodes[:-1]):
        if name_of(node) in KINDS and not is_token(nodes[k + 1], "ASSIGN") and nodes[k + 1] != ".":
            return k
    return None


def divisible(nodes: Sequence[Node], k: int, given: Arguments, text: str, file: int) -> Divisible | None:
    """A `MoveL` whose name has index `k` in its statement; None for other instructions, which may do more than move."""
    end = text.find(";", end_of(nodes[-1]))
    if name_of(nodes[k]) != "movel" or end < 0:
        return None
    target = given.required[0]
    return Divisible(
        Span(start_of(nodes[k]), end + 1, file), Span(start_of(target[0]), end_of(target[-1]), file)
    )
