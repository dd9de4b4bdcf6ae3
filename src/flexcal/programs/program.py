"""A robot program with the places of the numbers of its targets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from flexcal.programs.pose import Pose

if TYPE_CHECKING:
    from flexcal.programs.dialect import Dialect


@dataclass(frozen=True)
class ProgramFile:
    """A file of a program: its name in messages, and its text."""

    name: str
    text: str


@dataclass(frozen=True)
class Written:
    """A number in the text of a program: its value, its first character and the one after its last, and the index of its file."""

    value: float
    first: int
    end: int
    file: int = 0


@dataclass(frozen=True)
class Word:
    """A word of a target's configuration data, with its place as that of `Written`."""

    text: str
    first: int
    end: int
    file: int = 0


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
        Whether the numbers are joint positions, in the controller's order; else a pose of the tool in `frame`.
    numbers : tuple of Written
        The numbers in the order and units of the dialect's notation.
    near : tuple of float or None
        Joint positions of the controller, in its units, from which inverse kinematics starts, where the program gives them.
    tool : Pose or None
        Tool centre point in the flange; None where the program does not say it.
    missing : str
        What to give where `tool` is None.
    payload : float or None
        Mass (kg) that the arm carries there by the program; None where the program does not say it.
    motion : str
        The motion that goes there.
    straight : bool
        Whether the tool goes there along a line or an arc, which keeps the configuration of the arm.
    frame : Pose
        Frame in which poses are given (work object, base, user frame), in that of the controller.
    configuration : tuple of Word
        Configuration data that go with the pose; empty where the program gives none.
    """

    name: str
    line: int
    joints: bool
    numbers: tuple[Written, ...]
    near: tuple[float, ...] | None
    tool: Pose | None
    missing: str
    payload: float | None
    motion: str
    straight: bool
    frame: Pose = field(default_factory=Pose.identity)
    configuration: tuple[Word, ...] = ()

    @property
    def values(self) -> tuple[float, ...]:
        """Values of the numbers."""
        return tuple(number.value for number in self.numbers)

    @property
    def words(self) -> tuple[str, ...]:
        """Texts of the configuration data."""
        return tuple(word.text for word in self.configuration)

    @property
    def file(self) -> int:
        """Index of the file in which its numbers stand."""
        return self.numbers[0].file


@dataclass(frozen=True)
class NewNumbers:
    """Numbers of a target in the new program, as `ProgramTarget.values`, and its configuration data, as `ProgramTarget.words`."""

    values: tuple[float, ...]
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class RunTimeTarget:
    """Target that is no plain number in the program: line and text of its motion, why it stays as it is, and the index of its file."""

    line: int
    text: str
    reason: str
    file: int = 0


@dataclass(frozen=True)
class Program:
    """Files of a program, its `targets` in the order of their use, those `computed` at run time, and what is doubtful of them."""

    dialect: Dialect
    files: tuple[ProgramFile, ...]
    targets: tuple[ProgramTarget, ...]
    computed: tuple[RunTimeTarget, ...]
    remarks: tuple[str, ...]

    def rewritten(self, new: Mapping[int, NewNumbers]) -> tuple[ProgramFile, ...]:
        """Files with other numbers of the targets of these indices; all other characters, and numbers that hardly change, are kept."""
        edits: list[list[tuple[int, int, str]]] = [[] for _ in self.files]
        notation = self.dialect.notation
        for index, numbers in new.items():
            target = self.targets[index]
            for number, value in zip(target.numbers, numbers.values, strict=True):
                if not notation.keeps(value, number.value):
                    old = self.files[number.file].text[number.first : number.end]
                    edits[number.file].append((number.first, number.end, notation.text(value, old)))
            for word, text in zip(target.configuration, numbers.words, strict=True):
                if text != word.text:
                    edits[word.file].append((word.first, word.end, text))
        return tuple(
            replace(file, text=_edited(file.text, sorted(own)))
            for file, own in zip(self.files, edits, strict=True)
        )


def _edited(text: str, edits: list[tuple[int, int, str]]) -> str:
    parts, at = [], 0
    for first, end, new in edits:
        parts += [text[at:first], new]
        at = end
    return "".join([*parts, text[at:]])
