"""Positions of a TP program: the block /POS."""

from __future__ import annotations

import re
from dataclasses import dataclass

from lark import Token, Tree

from flexcal.programs.program import Word, Written
from flexcal.programs.syntax import whole_number

_POSE = (("X", "mm"), ("Y", "mm"), ("Z", "mm"), ("W", "deg"), ("P", "deg"), ("R", "deg"))
_JOINTS = tuple((f"J{k}", "deg") for k in range(1, 7))


@dataclass(frozen=True)
class FanucPosition:
    """A position of motion group 1.

    Attributes
    ----------
    number, name, line : int, str, int
        Its number, its text with its comment, and the line of its first number.
    joints : bool
        Whether the numbers are joint positions, deg; else a pose, mm and deg.
    numbers : tuple of Written
        Six numbers.
    frames : dict of int or None
        Numbers of the user frame ("UF") and of the tool ("UT"); None for the active ones (F).
    configuration : tuple of Word
        The six words of CONFIG.
    trouble : str
        Why it cannot be corrected; empty where it can.
    """

    number: int
    name: str
    line: int
    joints: bool
    numbers: tuple[Written, ...]
    frames: dict[str, int | None]
    configuration: tuple[Word, ...]
    trouble: str


def fanuc_positions(tree: Tree, file: int) -> dict[int, FanucPosition]:
    """Positions by their numbers."""
    found = {}
    for node in tree.find_data("position"):
        point = node.children[0]
        assert isinstance(point, Token)
        for group in node.find_data("group"):
            if re.match(r"GP1\b", str(group.children[0]), re.IGNORECASE):
                found[point_number(point)] = _position(point, group, file)
    return found


def point_number(token: Token) -> int:
    """Number of P[…]."""
    return whole_number(re.sub(r":.*|\D", "", str(token)))


def _position(point: Token, group: Tree, file: int) -> FanucPosition:
    fields = {
        str(field.children[0]).upper(): [node for node in field.children[1:] if isinstance(node, Token)]
        for field in group.find_data("field")
    }
    joints = "J1" in fields
    expected = _JOINTS if joints else _POSE
    numbers, trouble = [], ""
    for key, unit in expected:
        number, said = (_written(fields.get(key, []), file), _unit(fields.get(key, [])))
        if number is None:
            trouble = trouble or f"its {key} is not recorded"
        elif said not in ("", unit):
            trouble = trouble or f"its {key} is in {said}, not in {unit}"
        else:
            numbers.append(number)
    more = [key for key in fields if re.fullmatch(r"J[7-9]", key)]
    for key, value in fields.items():
        if key[0] == "E" and (number := _written(value, file)) is not None and number.value:
            trouble = trouble or (
                f"the external axis {key} is at {number.value:g}, which may carry the arm or the part, and its frame is not known"
            )
    if more:
        trouble = trouble or f"it has {more[-1]}, and the robot six joints"
    name = str(point).replace('"', "")
    line = _line_of(group, expected[0][0]) or point.line or 0
    return FanucPosition(
        point_number(point),
        name,
        line,
        joints,
        tuple(numbers),
        {key: _frame(fields.get(key, [])) for key in ("UF", "UT")},
        _configuration(fields.get("CONFIG", []), file),
        trouble,
    )


def _line_of(group: Tree, key: str) -> int | None:
    """Line of the field `key` of a group."""
    keys = (field.children[0] for field in group.find_data("field"))
    return next((token.line for token in keys if isinstance(token, Token) and token.upper() == key), None)


def _written(value: list[Token], file: int) -> Written | None:
    for token in value:
        if token.type == "NUMBER":
            assert token.start_pos is not None and token.end_pos is not None
            return Written(float(token), token.start_pos, token.end_pos, file)
    return None


def _unit(value: list[Token]) -> str:
    return next((str(token).lower() for token in value if token.type == "UNIT"), "")


def _frame(value: list[Token]) -> int | None:
    number = next((token for token in value if token.type == "NUMBER"), None)
    return None if number is None else whole_number(number)


def _configuration(value: list[Token], file: int) -> tuple[Word, ...]:
    """Words of CONFIG : 'N U T, 0, 0, 0'; empty where these are not six."""
    token = next((token for token in value if token.type == "CONFIGURATION"), None)
    if token is None or token.start_pos is None:
        return ()
    words = [
        Word(found[0], token.start_pos + found.start(), token.start_pos + found.end(), file)
        for found in re.finditer(r"[A-Za-z]|-?\d+", str(token))
    ]
    return tuple(words) if len(words) == 6 else ()
