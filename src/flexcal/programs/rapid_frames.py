"""Tools, work objects and loads of RAPID: tooldata, wobjdata and loaddata."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lark import Tree

from flexcal.programs.notation import Notation
from flexcal.programs.orientation import Quaternion
from flexcal.programs.pose import Pose
from flexcal.programs.rapid_data import RapidData
from flexcal.programs.syntax import (
    Node,
    Statement,
    between_commas,
    name_of,
    written_number,
    written_numbers,
)
from flexcal.units import DEGREE, MILLIMETRE

RAPID_NOTATION = Notation(MILLIMETRE, DEGREE, Quaternion(), 9)
"""Millimetres, degrees and quaternions."""


class Unreadable(Exception):
    """Why a motion's target cannot be corrected."""


@dataclass(frozen=True)
class RapidFrames:
    """Frames and masses of `data`."""

    data: RapidData

    def tool(self, argument: Sequence[Node], statement: Statement) -> tuple[Pose | None, str]:
        """Tool in the flange; None where it is not in the text, and what to give then. Raises `Unreadable` for one that stands still."""
        name = name_of(argument[0])
        if len(argument) == 1 and name == "tool0":
            return Pose.identity(), ""
        parts = self._parts(argument, statement, 3)
        if parts is None:
            told = f"{argument[0]} is {self._unknown(argument, statement)}"
            return None, f"the tool {told}: give the module that declares it too, or --tool"
        if name_of(parts[0]) == "false":
            raise Unreadable(
                f"the robot does not hold the tool {argument[0]}, which stands still; only tools on the arm are corrected"
            )
        pose = _pose(parts[1])
        if pose is None:
            return None, f"the frame of the tool {argument[0]} is not written as numbers: give --tool"
        return pose, ""

    def work_object(self, argument: Sequence[Node], statement: Statement) -> Pose:
        """Frame of the object in that of the controller; raises `Unreadable` where it is not in the text, or moves."""
        if not argument or (len(argument) == 1 and name_of(argument[0]) == "wobj0"):
            return Pose.identity()
        parts = self._parts(argument, statement, 5)
        if parts is None:
            told = self._unknown(argument, statement)
            raise Unreadable(f"the work object {argument[0]} is {told}: give the module that declares it too")
        if name_of(parts[0]) == "true":
            raise Unreadable(
                f"the robot holds the work object {argument[0]}; only tools on the arm are corrected"
            )
        if name_of(parts[1]) == "false":
            raise Unreadable(f"a mechanical unit moves the work object {argument[0]}")
        user, other = _pose(parts[3]), _pose(parts[4])
        if user is None or other is None:
            raise Unreadable(f"the frames of the work object {argument[0]} are not written as numbers")
        return user @ other

    def payload(
        self, tool: Sequence[Node], total: Sequence[Node] | None, load: float, statement: Statement
    ) -> float | None:
        """Mass, kg, of the tool and the `load` that is gripped, or that of `TLoad`; None where the tool is not in the text."""
        if total:
            return self.mass(total, statement)
        if len(tool) == 1 and name_of(tool[0]) == "tool0":
            return load
        parts = self._parts(tool, statement, 3)
        own = None if parts is None else _first_number(parts[2])
        return None if own is None else own + load

    def mass(self, argument: Sequence[Node], statement: Statement) -> float | None:
        """Mass of loaddata, kg; None where it is not in the text."""
        if len(argument) == 1 and name_of(argument[0]) == "load0":
            return 0.0
        value = self.data.value(list(argument), statement.file, statement.routine)
        return None if value is None else _first_number(value[0])

    def _parts(self, argument: Sequence[Node], statement: Statement, count: int) -> list[Node] | None:
        """Components of a record; None where they are not written."""
        value = self.data.value(list(argument), statement.file, statement.routine)
        if value is None or not isinstance(value[0], Tree):
            return None
        parts = [part[0] for part in between_commas(value[0].children) if len(part) == 1]
        return parts if len(parts) == count else None

    def _unknown(self, argument: Sequence[Node], statement: Statement) -> str:
        known = self.data.find(name_of(argument[0]), statement.file, statement.routine)
        return "not declared in the files given" if known is None else "not given by one value in the text"


def _pose(node: Node) -> Pose | None:
    """Pose of [[x, y, z], [q1, q2, q3, q4]]."""
    if not isinstance(node, Tree):
        return None
    parts = [written_numbers(part[0], 0) if part else None for part in between_commas(node.children)]
    if [len(part or ()) for part in parts] != [3, 4]:
        return None
    numbers = [number.value for part in parts for number in part or ()]
    return RAPID_NOTATION.pose(numbers) if any(numbers[3:]) else None


def _first_number(node: Node) -> float | None:
    if not isinstance(node, Tree) or not node.children:
        return None
    number = written_number(between_commas(node.children)[0], 0)
    return None if number is None else number.value
