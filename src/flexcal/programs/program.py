"""A robot program with the places of the numbers of its targets."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from flexcal.programs.pose import Pose

if TYPE_CHECKING:
    from flexcal.programs.dialect import Dialect


_NONE: Mapping[int, Sequence[NewNumbers]] = MappingProxyType({})


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
class Span:
    """A part of the text of a program: its first character, the one after its last, and the index of its file."""

    first: int
    end: int
    file: int = 0

    def of(self, files: Sequence[ProgramFile]) -> str:
        """Its text."""
        return files[self.file].text[self.first : self.end]


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
    literal : Span or None
        The whole target as it is written, for points on the way to it.
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
    literal: Span | None = None

    @property
    def variable(self) -> str:
        """Its name without the place of its numbers in an array."""
        return self.name.split("{")[0]

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
class Divisible:
    """The whole statement of a straight motion and in it the target, so that motions to points on the way can be written before it."""

    whole: Span
    target: Span


@dataclass(frozen=True)
class Move:
    """Motion of the tool from a target to another, by their indices: along a line, or along an arc through a third one.

    `divisible` is None where no points on the way can be written: on arcs, and in statements that do more than move.
    """

    start: int
    via: int | None
    end: int
    divisible: Divisible | None


@dataclass(frozen=True)
class RunTimeTarget:
    """Target that is no plain number in the program: line and text of its motion, why it stays as it is, and the index of its file.

    `sources` are the names of targets in the program that it is computed from.
    """

    line: int
    text: str
    reason: str
    file: int = 0
    sources: tuple[str, ...] = ()

    def reason_beside(self, corrected: Collection[str]) -> str:
        """Why it stays as it is, and which of its sources are among the names (lower case) of `corrected` targets."""
        names = [name for name in self.sources if name.lower() in corrected]
        if not names:
            return self.reason
        if self.reason.endswith(f" {names[-1]}"):
            return f"{self.reason}, as corrected"
        return f"{self.reason}, from {' and '.join(names)} as corrected"


@dataclass(frozen=True)
class Program:
    """A robot program that was read, as `read_program` returns it.

    Attributes
    ----------
    dialect : Dialect
        How it is written.
    files : tuple of ProgramFile
        Its files: name and text.
    targets : tuple of ProgramTarget
        Targets that are written as numbers, in the order of their use.
    computed : tuple of RunTimeTarget
        Motions whose targets the controller computes when the program runs.
    remarks : tuple of str
        What is doubtful of the targets.
    moves : tuple of Move
        Straight motions and arcs whose targets, and the one before, are written as numbers.
    """

    dialect: Dialect
    files: tuple[ProgramFile, ...]
    targets: tuple[ProgramTarget, ...]
    computed: tuple[RunTimeTarget, ...]
    remarks: tuple[str, ...]
    moves: tuple[Move, ...] = ()

    def rewritten(
        self, new: Mapping[int, NewNumbers], between: Mapping[int, Sequence[NewNumbers]] = _NONE
    ) -> tuple[ProgramFile, ...]:
        """Files with other numbers; all other characters, and numbers that hardly change, are kept.

        Parameters
        ----------
        new : mapping of NewNumbers
            Numbers of targets by their indices.
        between : mapping of sequence of NewNumbers
            Targets on the way to be inserted, by the index of the move.

        Returns
        -------
        tuple of ProgramFile
            The files.
        """
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
        for index, points in between.items():
            statement = self.moves[index].divisible
            assert statement is not None
            copies = [self._copy(self.moves[index], statement, point) for point in points]
            edits[statement.whole.file].append(
                (statement.whole.first, statement.whole.first, "".join(copies))
            )
        return tuple(
            replace(file, text=_edited(file.text, sorted(own)))
            for file, own in zip(self.files, edits, strict=True)
        )

    def can_insert(self, move: Move) -> bool:
        """Whether motions to points on the way can be written before the move: its statement begins a line.

        Parameters
        ----------
        move : Move
            One of `moves`.

        Returns
        -------
        bool
            Whether they can.
        """
        if move.divisible is None or self.targets[move.end].literal is None:
            return False
        return not self._indent(move.divisible).strip()

    def _indent(self, statement: Divisible) -> str:
        text = self.files[statement.whole.file].text
        return text[text.rfind("\n", 0, statement.whole.first) + 1 : statement.whole.first]

    def _copy(self, move: Move, statement: Divisible, point: NewNumbers) -> str:
        """The statement with a point in place of its target, and the indent of the next line."""
        target, whole = self.targets[move.end], statement.whole
        literal = target.literal
        assert literal is not None
        edits = [
            (number.first, number.end, self.dialect.notation.text(value, ""))
            for number, value in zip(target.numbers, point.values, strict=True)
        ]
        edits += [
            (word.first, word.end, text) for word, text in zip(target.configuration, point.words, strict=True)
        ]
        inside = [(first - literal.first, end - literal.first, text) for first, end, text in sorted(edits)]
        written = _edited(literal.of(self.files), inside)
        text = whole.of(self.files)
        before, after = statement.target.first - whole.first, statement.target.end - whole.first
        line_end = "\r\n" if "\r\n" in self.files[whole.file].text else "\n"
        return text[:before] + written + text[after:] + line_end + self._indent(statement)


def _edited(text: str, edits: list[tuple[int, int, str]]) -> str:
    parts, at = [], 0
    for first, end, new in edits:
        parts += [text[at:first], new]
        at = end
    return "".join([*parts, text[at:]])
