"""A robot program with the places of the numbers of its targets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

_KEPT = 5e-10
"""Change of a number below which its text stays as it is."""
_DECIMALS = 9


@dataclass(frozen=True)
class Written:
    """A number in the text of a program: its value, and the first character of its text and the one after its last."""

    value: float
    first: int
    end: int


@dataclass(frozen=True)
class ProgramTarget:
    """Target of a motion whose numbers are written in the program.

    Attributes
    ----------
    name : str
        The variable that holds it, or the motion's own name where the numbers stand in the motion.
    line : int
        Line of its first number.
    joints : bool
        Whether the numbers are joint positions, rad or m; else position (m) and rotation vector (rad) of the tool in the robot's base.
    numbers : tuple of Written
        The numbers in the order of the program.
    near : tuple of float or None
        Joint positions from which inverse kinematics of the controller starts, where the program gives them.
    tool : tuple of float or None
        Position (m) and rotation vector (rad) of the tool centre point in the flange; None where the program does not set them before.
    payload : float or None
        Mass (kg) that the program sets before; None where it sets none.
    motion : str
        The motion that goes there.
    straight : bool
        Whether the tool goes there along a line or an arc, which keeps the configuration of the arm.
    """

    name: str
    line: int
    joints: bool
    numbers: tuple[Written, ...]
    near: tuple[float, ...] | None
    tool: tuple[float, ...] | None
    payload: float | None
    motion: str
    straight: bool

    @property
    def values(self) -> tuple[float, ...]:
        """Values of the numbers."""
        return tuple(number.value for number in self.numbers)


@dataclass(frozen=True)
class RunTimeTarget:
    """Target that is no plain number in the program, with the line and the text of its motion, and why it stays as it is."""

    line: int
    text: str
    reason: str


@dataclass(frozen=True)
class Program:
    """Text of a program, its `targets` in the order of their use, those `computed` at run time, and what is doubtful of them."""

    text: str
    targets: tuple[ProgramTarget, ...]
    computed: tuple[RunTimeTarget, ...]
    remarks: tuple[str, ...]

    def rewritten(self, values: Mapping[int, Sequence[float]]) -> str:
        """Text with other values of the targets of these indices; all other characters, and numbers that hardly change, are kept."""
        edits = [
            (number, float(value))
            for index, new in values.items()
            for number, value in zip(self.targets[index].numbers, new, strict=True)
            if abs(value - number.value) > _KEPT
        ]
        text, parts = self.text, []
        at = 0
        for number, value in sorted(edits, key=lambda edit: edit[0].first):
            parts += [text[at : number.first], _plain(value)]
            at = number.end
        return "".join([*parts, text[at:]])


def _plain(value: float) -> str:
    """Text of a number without an exponent, to a nanometre or a nanoradian."""
    text = f"{value:.{_DECIMALS}f}".rstrip("0")
    text = text + "0" if text.endswith(".") else text
    return "0.0" if text == "-0.0" else text
