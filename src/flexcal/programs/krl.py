"""Targets of a KRL program (KUKA)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from flexcal.programs.arm_at_zero import ArmAtZero
from flexcal.programs.dialect import Dialect
from flexcal.programs.krl_configuration import StatusAndTurn
from flexcal.programs.krl_data import KrlData, components, is_list, numbers_of, statements_of, variable_name
from flexcal.programs.krl_frames import KRL_NOTATION, POSE, KrlFrames, Setting
from flexcal.programs.pose import Pose
from flexcal.programs.program import Divisible, Program, ProgramFile, ProgramTarget, Span, Word
from flexcal.programs.syntax import (
    Node,
    Statement,
    between_commas,
    end_of,
    is_token,
    is_tree,
    line_of,
    name_of,
    names_in,
    parse_text,
    start_of,
    written_number,
)
from flexcal.programs.target_list import RUN_TIME, TargetList

_MOTIONS = {"ptp": 1, "lin": 1, "circ": 2, "sptp": 1, "slin": 1, "scirc": 2, "spl": 1}
"""Motions, and how many of their first arguments are targets."""
_RELATIVE = tuple(f"{name}_rel" for name in _MOTIONS)
_AXES = ("a1", "a2", "a3", "a4", "a5", "a6")
_FRAMES = ("$tool", "$base", "$robroot")
_EXTERNAL = ("e1", "e2", "e3", "e4", "e5", "e6")


def parse_krl(files: Sequence[ProgramFile]) -> Program:
    """Find the targets of a KRL program that are written as numbers.

    A target is an E6POS, POS or FRAME, or an E6AXIS or AXIS, with all its six numbers, in a motion or in a variable of one value. Tool,
    base and load are those of `$TOOL`, `$BASE`, `$LOAD`, `BAS` and the data of inline forms, and hold for what follows in the routine.

    Parameters
    ----------
    files : sequence of ProgramFile
        Programs (.src) and data lists (.dat); $config.dat has the tools, bases and loads that are numbered.

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
    >>> text = '''DEF m()
    ... $TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}
    ... $BASE=$NULLFRAME
    ... PTP {X 600,Y 0,Z 500,A 0,B 90,C 0,S 2,T 2}
    ... LIN_REL {Z 50}
    ... END'''
    >>> program = parse_krl([ProgramFile("m.src", text)])
    >>> program.targets[0].values, program.targets[0].words, program.targets[0].tool.position.tolist()
    ((600.0, 0.0, 500.0, 0.0, 90.0, 0.0), ('2', '2'), [0.0, 0.0, 0.1])
    >>> program.computed[0].reason
    'it is relative to where the robot stands'
    """
    statements = [
        statement for k, file in enumerate(files) for statement in statements_of(parse_text(file, "krl"), k)
    ]
    return _Reader(files, statements, KrlData.of(files, statements)).program()


@dataclass
class _Reader:
    """Walk through the lines in the order of the text, with the frames that hold there."""

    files: Sequence[ProgramFile]
    statements: Sequence[Statement]
    data: KrlData
    moved_axes: list[str] = field(default_factory=list)
    found: TargetList = field(default_factory=TargetList)

    def program(self) -> Program:
        """The program that was read."""
        frames = KrlFrames(self.data)
        held = []
        for statement in self.statements:
            frames = frames.after(statement)
            held.append(frames)
        tools = _distinct([each.tool for each in held if each.tool is not None])
        bases = _distinct([each.base for each in held if each.base is not None])
        for statement, frames in zip(self.statements, held, strict=True):
            name = name_of(statement.nodes[0])
            if not names_in(statement.nodes).isdisjoint(("def", "deffct")):
                self.found.interrupt()
            if name in _RELATIVE:
                self.found.begin(1, straight=False)
                self.found.leave(
                    statement.line,
                    statement.text(self.files),
                    "it is relative to where the robot stands",
                    statement.file,
                )
            elif name in _MOTIONS and len(statement.nodes) > 1 and statement.nodes[1] != "=":
                self._motion(statement, name, frames, tools, bases)
        self.found.interrupt()
        self._unused()
        remarks = []
        if self.moved_axes:
            remarks.append(
                f"external axes of {self.moved_axes[0]}{' and others' if len(self.moved_axes) > 1 else ''} stay as they are, and are taken "
                "to carry neither robot nor base"
            )
        names = {name for _, name in self.data.known}
        return self.found.program(KRL, self.files, names, remarks)

    def _motion(
        self, statement: Statement, motion: str, frames: KrlFrames, tools: list[Setting], bases: list[Setting]
    ) -> None:
        """Note the targets of a motion."""
        ends = [k for k, node in enumerate(statement.nodes) if name_of(node) == "with"]
        end = ends[0] if ends else len(statement.nodes)
        for part in between_commas(statement.nodes[end + 1 :]):
            if len(part) > 2 and part[1] == "=":
                value = [node for node in part[2:] if not name_of(node).startswith("c_")]
                frames = frames.set(name_of(part[0]), value, statement.file)
        arguments = between_commas(statement.nodes[1:end])
        divisible = self._divisible(statement, arguments[0]) if motion in ("lin", "slin") else None
        self.found.begin(_MOTIONS[motion], straight=motion not in ("ptp", "sptp"), divisible=divisible)
        for argument in arguments[: _MOTIONS[motion]]:
            expression = [node for node in argument if not name_of(node).startswith("c_")]
            reason = self._target(statement, motion, expression, frames, tools, bases)
            if reason:
                self.found.leave(statement.line, statement.text(self.files), reason, statement.file)

    def _divisible(self, statement: Statement, argument: list[Node]) -> Divisible | None:
        target = [node for node in argument if not name_of(node).startswith("c_")]
        if not target:
            return None
        return Divisible(
            Span(start_of(statement.nodes[0]), end_of(statement.nodes[-1]), statement.file),
            Span(start_of(target[0]), end_of(target[-1]), statement.file),
        )

    def _target(
        self,
        statement: Statement,
        motion: str,
        expression: list[Node],
        frames: KrlFrames,
        tools: list[Setting],
        bases: list[Setting],
    ) -> str:
        """Note a target of a motion; why there is none that can be corrected, or empty."""
        value = self.data.value(expression, statement.file)
        if value is None:
            return self._why(statement, expression)
        joints = numbers_of(*value, _AXES)
        numbers = joints or numbers_of(*value, POSE)
        if numbers is None:
            return "only some of its numbers are written, the others are those of where the robot stands"
        tool = frames.tool or (tools[0] if len(tools) == 1 else None)
        base = frames.base or (bases[0] if len(bases) == 1 else None)
        if joints is None:
            if frames.outside:
                return frames.outside
            if base is None or base.known is None:
                return (
                    base.wrong if base is not None else "its routine sets no base ($BASE, FDAT_ACT) before it"
                )
        name = variable_name(expression) or motion.upper()
        moves = any(self._turned(*value, axis) for axis in _EXTERNAL)
        if moves and name not in self.moved_axes:
            self.moved_axes.append(name)
        missing = "its routine sets no tool ($TOOL, FDAT_ACT) before it" if tool is None else tool.wrong
        target = ProgramTarget(
            name,
            line_of(value[0]),
            joints is not None,
            numbers,
            None,
            None if tool is None else tool.known,
            f"{missing}, or --tool" if "give" in missing else f"{missing}: give --tool",
            None if tool is None else tool.mass,
            motion.upper(),
            motion not in ("ptp", "sptp"),
            literal=None if moves else Span(start_of(value[0]), end_of(value[0]), value[1]),
        )
        if joints is None and base is not None and base.known is not None:
            frame = self._robot_root(statement.file).inverse() @ base.known
            target = replace(target, frame=frame, configuration=self._words(*value))
        self.found.add(target)
        return ""

    def _robot_root(self, file: int) -> Pose:
        """The robot's root in the world frame, which is its own where no file says another."""
        root = self.data.find("$robroot", file)
        numbers = None if root is None or root.value is None else numbers_of(root.value, root.file, POSE)
        return Pose.identity() if numbers is None else KRL_NOTATION.pose([each.value for each in numbers])

    def _turned(self, node: Node, file: int, axis: str) -> bool:
        number = written_number(components(node).get(axis, []), file)
        return number is not None and number.value != 0

    def _words(self, node: Node, file: int) -> tuple[Word, ...]:
        """S and T; empty where one is missing."""
        parts = components(node)
        words = []
        for name in ("s", "t"):
            part = parts.get(name, [])
            if len(part) != 1 or not (is_token(part[0], "NUMBER") or is_token(part[0], "STRING")):
                return ()
            first, end = start_of(part[0]), end_of(part[0])
            words.append(Word(self.files[file].text[first:end], first, end, file))
        return tuple(words)

    def _why(self, statement: Statement, expression: list[Node]) -> str:
        name = variable_name(expression)
        if not name or not expression or is_tree(expression[0], "aggregate"):
            return RUN_TIME
        variable = self.data.find(name, statement.file)
        if variable is None:
            return f"{expression[0]} is not set in the files given: give the data list (.dat) that has it too"
        if len(variable.values) > 1:
            return f"{expression[0]} is set more than once, so its numbers depend on how the program runs"
        return RUN_TIME

    def _unused(self) -> None:
        """Name the variables with numbers that the program uses, but in no motion that is read."""
        places = {(target.file, target.numbers[0].first) for target in self.found.targets.values()}
        named = {
            name
            for statement in self.statements
            if not is_list(self.files[statement.file])
            for name in names_in(statement.nodes)
        }
        left = {name for item in self.found.computed for name in item.text.lower().split()}
        for (_, name), variable in self.data.known.items():
            node = variable.value
            if node is None or name not in named or name in left or name in _FRAMES:
                continue
            numbers = numbers_of(node, variable.file, _AXES)
            if numbers is None and self._words(node, variable.file):
                numbers = numbers_of(node, variable.file, POSE)
            if numbers is not None and (variable.file, numbers[0].first) not in places:
                reason = "no motion with plain arguments goes to it, so its tool and base are unknown"
                self.found.leave(line_of(node), name.upper(), reason, variable.file)


def _distinct(settings: Sequence[Setting]) -> list[Setting]:
    """The settings without those that are the same."""
    several: list[Setting] = []
    for setting in settings:
        if not any(setting.same(other) for other in several):
            several.append(setting)
    return several


KRL = Dialect(
    "KRL of KUKA",
    (".src", ".dat", ".sub"),
    KRL_NOTATION,
    parse_krl,
    beside=(".src", ".dat"),
    configuration=StatusAndTurn(),
    zero=ArmAtZero(((0, 0, -1), (0, 1, 0), (0, 1, 0), (-1, 0, 0), (0, 1, 0), (-1, 0, 0)), (1, 0, 0)),
    no_start="no joint positions or S and T stand before it",
)
"""KRL: millimetres, degrees, and A, B, C about z, y, x."""
