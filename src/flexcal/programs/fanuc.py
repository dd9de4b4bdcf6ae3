"""Targets of a TP program (Fanuc), as its controllers write them in ASCII.

Sources: FANUC Robot series, Operator's Manual (Basic Operation): motion instructions, position data, frames, ASCII programs. That J3 counts
from the horizontal is how Fanuc's controllers display and command it (ROS-Industrial, package fanuc_driver: J3 of the URDF is J2 + J3).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedInput

from flexcal.errors import InputError
from flexcal.programs.arm_at_zero import ArmAtZero
from flexcal.programs.dialect import Dialect
from flexcal.programs.fanuc_configuration import FanucConfiguration
from flexcal.programs.fanuc_positions import FanucPosition, fanuc_positions, point_number
from flexcal.programs.fanuc_tables import FanucTables, fanuc_tables
from flexcal.programs.notation import Notation
from flexcal.programs.orientation import RollPitchYaw
from flexcal.programs.pose import Pose
from flexcal.programs.program import Program, ProgramFile, ProgramTarget, RunTimeTarget
from flexcal.programs.syntax import whole_number
from flexcal.programs.target_list import TargetList
from flexcal.units import DEGREE

_SHIFTS = {
    "OFFSET": "an offset",
    "TOOL_OFFSET": "an offset of the tool",
    "VOFFSET": "an offset of the camera",
    "INC": "an increment",
}
"""Words of a motion that move its target, and what they add."""
_ELSEWHERE = ("LBL", "CALL", "RUN")
"""Instructions after which the robot may come from elsewhere than from the position before them in the text."""
_FRAMES = {"UF": ("UFRAME_NUM", "UFRAME", "user frame"), "UT": ("UTOOL_NUM", "UTOOL", "tool")}
"""Instructions that choose the active frame, and that set its numbers, and its name."""


def parse_fanuc(files: Sequence[ProgramFile]) -> Program:
    """Find the targets of TP programs in ASCII (.ls), with the tools and user frames of a SYSFRAME.VA (.va) among the files.

    A target is a position P[…] of the program with numbers, Cartesian or joints, of motion group 1, that a motion J, L, C, A or S goes to.
    Positions in registers (PR), those that an instruction shifts (Offset, Tool_Offset, INC), and those in frames that the program
    itself sets are left, and named.

    Raises
    ------
    InputError
        Where a program or the table of frames cannot be read.

    Examples
    --------
    >>> joints = "J1= 10.0 deg, J2= -20.000 deg, J3= .000 deg, J4= 0.000 deg, J5= -70.500 deg, J6= 0.000 deg"
    >>> text = f"/MN\\n 1:J P[1] 9% FINE ;\\n 2:L PR[7] 9mm/sec ;\\n/POS\\nP[1:\"home\"]{{\\nGP1:\\nUF : 0, UT : 0,\\n{joints}\\n}};\\n"
    >>> program = parse_fanuc([ProgramFile("a.ls", text)])
    >>> program.targets[0].name, program.targets[0].values
    ('P[1:home]', (10.0, -20.0, 0.0, 0.0, -70.5, 0.0))
    >>> program.computed[0].text, program.computed[0].reason
    ('L PR[7] 9mm/sec', 'its position stands in a register of the controller')
    """
    tables, found = fanuc_tables(files), TargetList()
    readers = []
    for index, file in enumerate(files):
        if Path(file.name).suffix.lower() in _TABLES:
            continue
        try:
            tree = _grammar().parse(file.text)
        except UnexpectedInput as error:
            raise InputError(
                "E-PROG-013",
                f"{file.name}, line {error.line}: this is not as a Fanuc controller writes a TP program, so it cannot be read; correct it.",
            ) from error
        readers.append(_Reader(index, file, tree, tables, found))
        readers[-1].read()
    unknown = {ut for reader in readers for ut in reader.unknown_tools()}
    for reader in readers:
        if len(unknown) > 1:
            reader.leave_unknown_tools(unknown)
        reader.note_taken()
    payloads = {payload for reader in readers for payload in reader.payloads}
    remarks = [remark for reader in readers for remark in reader.remarks]
    if payloads:
        remarks.append(
            f"the program chooses payload schedules ({', '.join(sorted(payloads))}), whose masses it does not say: the mass of robot.yaml "
            "counts everywhere"
        )
    return found.program(FANUC, files, (), remarks)


@cache
def _grammar() -> Lark:
    return Lark(
        Path(__file__).with_suffix(".lark").read_text("utf-8"), parser="lalr", propagate_positions=True
    )


@dataclass
class _Reader:
    """Walk through the program in the order of its text, with the user frame and the tool that are active there."""

    file: int
    source: ProgramFile
    tree: Tree
    tables: FanucTables
    found: TargetList
    active: dict[str, int | None] = field(default_factory=lambda: {"UF": None, "UT": None})
    set_by_program: set[tuple[str, int | None]] = field(default_factory=set)
    payloads: set[str] = field(default_factory=set)
    tools: dict[tuple[int, int], int | None] = field(default_factory=dict)
    places: dict[int, tuple[int, int]] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    taken: list[tuple[Tree, int, str]] = field(default_factory=list)

    def read(self) -> None:
        """Find the targets, and the motions whose targets the controller computes."""
        head = str(self.tree.children[0])
        mask = re.search(r"DEFAULT_GROUP\s*=\s*([*\d])", head, re.IGNORECASE)
        moves = mask is None or mask[1] != "*"
        if not moves:
            self.remarks.append(
                "the program does not move motion group 1 (DEFAULT_GROUP), whose positions alone are read"
            )
        positions = fanuc_positions(self.tree, self.file)
        for statement in self.tree.find_data("statement"):
            self._note_frames(statement)
        for statement in self._statements():
            words = _words(statement)
            if any(token.type == "MOTION" for token in words):
                if moves:
                    self._motion(statement, positions)
                continue
            for number in (point_number(token) for token in words if token.type == "POINT"):
                self.taken.append((statement, number, "it takes"))
            self._instruction(words)

    def unknown_tools(self) -> set[int | None]:
        """Numbers of the tools of poses that no table has."""
        return {ut for place, ut in self.tools.items() if _lacks_tool(self.found.targets[place])}

    def leave_unknown_tools(self, unknown: set[int | None]) -> None:
        """Leave the poses of tools that are not known, where one --tool cannot stand for all."""
        several = ", ".join(map(str, sorted(ut for ut in unknown if ut is not None)))
        for place, ut in self.tools.items():
            if _lacks_tool(self.found.targets[place]):
                self.found.doubtful[place] = (
                    f"its tool {ut} is not in the program, nor are its others ({several}): give the controller's SYSFRAME.VA after the "
                    "program"
                )

    def note_taken(self) -> None:
        """Note the motions and instructions that take corrected positions without going there as they are."""
        for statement, number, what in self.taken:
            place = self.places.get(number)
            corrected = place is not None and place not in self.found.doubtful
            if corrected or any(token.type == "MOTION" for token in _words(statement)):
                name = self.found.targets[place].name if place is not None and corrected else f"P[{number}]"
                item = self._left(statement, f"{what} {name}")
                self.found.computed.append(replace(item, sources=(name,) if corrected else ()))

    def _statements(self) -> list[Tree]:
        return [node for node in self.tree.children if isinstance(node, Tree) and node.data == "statement"]

    def _note_frames(self, statement: Tree) -> None:
        """Note the frames whose numbers the program sets."""
        words = [token for token in _words(statement) if token.type not in ("LABEL", "REMARK")]
        for key, (_, table, _) in _FRAMES.items():
            if len(words) > 3 and words[0].upper() == table and words[1] == "[":
                number = whole_number(words[2]) if words[2].type == "NUMBER" and words[3] == "]" else None
                self.set_by_program.add((key, number))

    def _instruction(self, words: Sequence[Token]) -> None:
        """Follow the active frames and payloads."""
        words = [token for token in words if token.type != "LABEL"]
        if not words:
            return
        name = words[0].upper()
        if name in _ELSEWHERE:
            self.found.interrupt()
        for key, (choice, _, _) in _FRAMES.items():
            if name == choice:
                last = words[-1]
                whole = len(words) == 3 and last.type == "NUMBER" and last.isdigit()
                self.active[key] = whole_number(last) if whole else None
        if name == "PAYLOAD":
            self.payloads.add("".join(words[2:3]))

    def _motion(self, statement: Tree, positions: dict[int, FanucPosition]) -> None:
        words = _words(statement)
        letter = next(str(token).strip().upper() for token in words if token.type == "MOTION")
        shift = next((_SHIFTS[token.upper()] for token in words if token.upper() in _SHIFTS), "")
        goals = [token for token in words if token.type in ("POINT", "REGISTER")][: 2 if letter == "C" else 1]
        self.found.begin(max(1, len(goals)), straight=letter in "LC")
        if not goals:
            self._leave(statement, "its position cannot be read")
        for token in goals:
            number = None if token.type == "REGISTER" else point_number(token)
            position = None if number is None else positions.get(number)
            if number is None:
                what = "position" if token.upper().startswith("PR") else "position's number"
                self._leave(statement, f"its {what} stands in a register of the controller")
            elif shift:
                self.found.interrupt()
                self.taken.append((statement, number, f"the controller adds {shift} to"))
            elif position is None:
                self._leave(statement, f"P[{number}] is not in the program's positions")
            elif position.trouble:
                self._leave(statement, position.trouble)
            else:
                self._target(statement, letter, position)

    def _target(self, statement: Tree, letter: str, position: FanucPosition) -> None:
        known: dict[str, int | None] = {}
        for key, (choice, table, _) in _FRAMES.items():
            written = position.frames[key]
            known[key] = self.active[key] if written is None else written
            if position.joints:
                continue
            if known[key] is None:
                self._leave(
                    statement, f"P[{position.number}] counts in the active frame, and no {choice} before it says which"
                )  # fmt: skip
                return
            if self.set_by_program & {(key, known[key]), (key, None)}:
                self._leave(statement, f"the program itself sets {table}[{known[key]}]")
                return
        frame = Pose.identity() if position.joints else self.tables.pose("UF", known["UF"])
        if frame is None:
            self._leave(
                statement,
                f"P[{position.number}] counts in user frame {known['UF']}, which is not in the program: give the controller's "
                "SYSFRAME.VA after the program",
            )
            return
        place = (self.file, position.numbers[0].first)
        self.places[position.number] = place
        self.tools.setdefault(place, known["UT"])
        self.found.add(
            ProgramTarget(
                position.name,
                position.line,
                position.joints,
                position.numbers,
                None,
                self.tables.pose("UT", known["UT"]),
                f"tool {known['UT']} is not in the program: give the controller's SYSFRAME.VA after the program, or --tool",
                None,
                letter,
                letter != "J",
                frame,
                position.configuration,
            )
        )

    def _leave(self, statement: Tree, reason: str) -> None:
        item = self._left(statement, reason)
        self.found.leave(item.line, item.text, item.reason, item.file)

    def _left(self, statement: Tree, reason: str) -> RunTimeTarget:
        first = next(token for token in _words(statement) if token.type != "LABEL")
        said = " ".join(self.source.text[first.start_pos : statement.meta.end_pos].rstrip(";").split())
        return RunTimeTarget(int(first.line or 0), said, reason, self.file)


def _lacks_tool(target: ProgramTarget) -> bool:
    return target.tool is None and not target.joints


def _words(statement: Tree) -> list[Token]:
    return [node for node in statement.children if isinstance(node, Token) and node.type != "END"]


_TABLES = (".va",)
FANUC = Dialect(
    "TP programs of Fanuc",
    (".ls", *_TABLES),
    Notation(1e-3, DEGREE, RollPitchYaw((0, 1, 2)), 6),
    parse_fanuc,
    tables=_TABLES,
    configuration=FanucConfiguration(),
    zero=ArmAtZero(
        ((0, 0, 1), (0, 1, 0), (0, -1, 0), (-1, 0, 0), (0, -1, 0), (-1, 0, 0)),
        (0, 0, 1),
        base_at_axis_2=True,
    ),
    level_forearm=True,
    no_start="no joint positions stand before it, and its CONFIG names no posture of this arm",
)
"""TP programs: millimetres and degrees, W, P, R about fixed x, y, z, J3 from the horizontal, and configurations as N U T."""
