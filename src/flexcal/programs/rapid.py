"""Targets of a RAPID program (ABB)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from lark import Tree

from flexcal.programs.arm_at_zero import ArmAtZero
from flexcal.programs.dialect import Dialect
from flexcal.programs.pose import Pose
from flexcal.programs.program import Program, ProgramFile, ProgramTarget, Span, Written
from flexcal.programs.rapid_configuration import QuadrantConfiguration
from flexcal.programs.rapid_data import RapidData, statements_of
from flexcal.programs.rapid_frames import RAPID_NOTATION, RapidFrames, Unreadable
from flexcal.programs.rapid_motion import KINDS, Arguments, MotionKind, divisible, motion_in
from flexcal.programs.syntax import (
    Node,
    Statement,
    as_word,
    between_commas,
    end_of,
    is_tree,
    line_of,
    name_of,
    names_in,
    parse_text,
    start_of,
    written_numbers,
)
from flexcal.programs.target_list import RUN_TIME, TargetList

_NO_AXIS = 8e9
"""Positions of external axes from here on say that there is none (9E9)."""


def parse_rapid(files: Sequence[ProgramFile]) -> Program:
    """Find the targets of RAPID modules that are written as numbers.

    A target is a robtarget or jointtarget, in a motion instruction or in data of one value. Tools, work objects and loads are found in
    all the files; `GripLoad`, `ConfJ`, `ConfL` and program displacements hold for what follows in the text.

    Parameters
    ----------
    files : sequence of ProgramFile
        The modules.

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
    >>> text = '''MODULE m
    ...   CONST robtarget p1:=[[600,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    ...   PROC main()
    ...     MoveL p1,v100,fine,tool0;
    ...     MoveL Offs(p1,0,0,50),v100,fine,tool0;
    ...   ENDPROC
    ... ENDMODULE'''
    >>> program = parse_rapid([ProgramFile("m.mod", text)])
    >>> program.targets[0].values, program.targets[0].words
    ((600.0, 0.0, 400.0, 0.0, 0.0, 1.0, 0.0), ('0', '0', '0', '0'))
    >>> program.computed[0].reason, program.computed[0].sources
    ('the controller computes it when the program runs', ('p1',))
    """
    statements = [
        statement for k, file in enumerate(files) for statement in statements_of(parse_text(file, "rapid"), k)
    ]
    return _Reader(files, statements, RapidData.of(statements)).program()


@dataclass
class _Reader:
    """Walk through the statements in the order of the text, with the load and the switches that hold there."""

    files: Sequence[ProgramFile]
    statements: Sequence[Statement]
    data: RapidData
    load: float = 0.0
    loads: set[float] = field(default_factory=set)
    configured: dict[str, bool] = field(default_factory=lambda: {"confj": True, "confl": True})
    displaced: bool = False
    moved_axes: list[str] = field(default_factory=list)
    found: TargetList = field(default_factory=TargetList)

    @property
    def frames(self) -> RapidFrames:
        """Tools, work objects and loads."""
        return RapidFrames(self.data)

    def program(self) -> Program:
        """The program that was read."""
        for statement in self.statements:
            self._switch(statement)
            if not names_in(statement.nodes).isdisjoint(("proc", "func", "trap")):
                self.found.interrupt()
            if (k := motion_in(statement.nodes)) is not None:
                self._motion(statement, k)
        self.found.interrupt()
        self._unused()
        remarks = []
        if len(self.loads) > 1:
            remarks.append(
                "the program sets several loads (GripLoad); each holds for the motions after it in the text, also where routines are run "
                "in another order"
            )
        if self.moved_axes:
            remarks.append(
                f"external axes of {self.moved_axes[0]}{' and others' if len(self.moved_axes) > 1 else ''} stay as they are, and are taken "
                "to carry neither robot nor work object"
            )
        if any(target.joints for target in self.found.targets.values()):
            remarks.append(
                "axis 3 of joint targets is taken to count from the lower arm; arms with a parallel rod (as IRB 2400 and 4400) count it "
                "otherwise, and their joint targets must not be corrected"
            )
        names = {name for _, _, name in self.data.known}
        return self.found.program(RAPID, self.files, names, remarks)

    def _switch(self, statement: Statement) -> None:
        """Note what holds for the motions that follow."""
        for k, node in enumerate(statement.nodes):
            name = name_of(node)
            if name == "gripload":
                self.load = self.frames.mass(statement.nodes[k + 1 :], statement) or 0.0
                self.loads.add(self.load)
            elif name in self.configured:
                self.configured[name] = "off" not in {name_of(each) for each in statement.nodes[k:]}
            elif name in ("pdispon", "pdispset"):
                self.displaced = True
            elif name == "pdispoff":
                self.displaced = False

    def _motion(self, statement: Statement, k: int) -> None:
        """Note the targets of a motion."""
        name, kind = str(statement.nodes[k]), KINDS[name_of(statement.nodes[k])]
        given = Arguments.of(statement.nodes[k + 1 :])
        text = statement.text(self.files, k)
        count = max(*kind.targets, kind.tool) + 1
        if len(given.required) <= count - (kind.tool >= 0):
            self.found.begin(1, straight=False)
            self.found.leave(
                line_of(statement.nodes[k]), text, "its arguments cannot be read", statement.file
            )
            return
        self.found.begin(
            len(kind.targets),
            straight=kind.straight,
            divisible=divisible(statement.nodes, k, given, self.files[statement.file].text, statement.file),
        )
        for index in kind.targets:
            try:
                for target in self._targets(statement, name, kind, given, given.required[index]):
                    self.found.add(target)
            except Unreadable as reason:
                self.found.leave(line_of(statement.nodes[k]), text, str(reason), statement.file)

    def _targets(
        self, statement: Statement, motion: str, kind: MotionKind, given: Arguments, argument: list[Node]
    ) -> list[ProgramTarget]:
        """Targets that an argument is, several where it is an element of an array whose index is computed."""
        if len(argument) == 1 and argument[0] == "*":
            raise Unreadable("its position is not in the text (*)")
        aggregates = self._aggregates(statement, argument)
        tool = given.required[kind.tool]
        pose, missing = None, ""
        payload = self.frames.payload(tool, given.optional.get("tload"), self.load, statement)
        frame = Pose.identity()
        if not kind.joints:
            if self.displaced:
                raise Unreadable("a program displacement (PDispOn, PDispSet) holds there")
            pose, missing = self.frames.tool(tool, statement)
            frame = self.frames.work_object(given.optional.get("wobj", []), statement)
        name = self._text_of(argument, statement) if name_of(argument[0]) else motion
        switch = "confl" if kind.straight else "confj"
        targets = []
        for node, file in aggregates:
            numbers, words, external = self._numbers(node, file, joints=kind.joints)
            moves = any(0 < abs(axis.value) < _NO_AXIS for axis in external)
            if moves and name not in self.moved_axes:
                self.moved_axes.append(name)
            targets.append(
                ProgramTarget(
                    name,
                    line_of(node),
                    kind.joints,
                    numbers,
                    None,
                    pose,
                    missing,
                    payload,
                    motion,
                    kind.straight,
                    frame,
                    tuple(as_word(each, self.files[file].text) for each in words if self.configured[switch]),
                    None if moves else Span(start_of(node), end_of(node), file),
                )
            )
        return targets

    def _aggregates(self, statement: Statement, argument: list[Node]) -> list[tuple[Tree, int]]:
        """Brackets of a target, or of all elements of an array of targets whose index is computed, with the indices of their files."""
        file, routine = statement.file, statement.routine
        if len(argument) == 2 and isinstance(argument[1], Tree) and argument[1].data == "index":
            value = self.data.value(argument[:1], file, routine)
            found = [] if value is None else self.data.elements(value, argument[1])
            if value is not None and not found:
                raise Unreadable(f"not all elements of {argument[0]} are written, or it has no such one")
        else:
            value = self.data.value(argument, file, routine)
            found = [] if value is None else [value]
        if value is None:
            raise Unreadable(self._why(statement, argument))
        return [(node, place) for node, place in found if isinstance(node, Tree)]

    def _numbers(
        self, node: Tree, file: int, *, joints: bool
    ) -> tuple[tuple[Written, ...], tuple[Written, ...], tuple[Written, ...]]:
        """Numbers of a robtarget or jointtarget, of its configuration data, and of its external axes."""
        parts = [written_numbers(part[0], file) if part else None for part in between_commas(node.children)]
        sizes = [len(part) if part else 0 for part in parts]
        if joints and sizes == [6, 6]:
            return parts[0] or (), (), parts[1] or ()
        if not joints and sizes == [3, 4, 4, 6]:
            position, orientation, words, external = (part or () for part in parts)
            return position + orientation, words, external
        raise Unreadable(RUN_TIME)

    def _why(self, statement: Statement, argument: list[Node]) -> str:
        name = name_of(argument[0])
        if not name or (len(argument) > 1 and not is_tree(argument[1], "index")):
            return RUN_TIME
        datum = self.data.find(name, statement.file, statement.routine)
        if datum is None:
            return f"{argument[0]} is not declared in the files given: give the module that declares it too"
        if len(datum.values) > 1:
            return f"{argument[0]} is set more than once, or a parameter, so its numbers depend on how the program runs"
        return RUN_TIME if datum.values else f"{argument[0]} has no value in the text"

    def _text_of(self, argument: list[Node], statement: Statement) -> str:
        return Statement(argument, statement.file, statement.routine).text(self.files)

    def _unused(self) -> None:
        """Name the targets with numbers that the program uses, but in no motion that is read."""
        used = {
            (target.file, number.first) for target in self.found.targets.values() for number in target.numbers
        }
        declares = ("const", "pers", "var")
        plain = [
            each.nodes
            for each in self.statements
            if not {name_of(node) for node in each.nodes} & set(declares)
        ]
        named = {name for nodes in plain for name in names_in(nodes)}
        for (_, _, name), datum in self.data.known.items():
            node = datum.value
            if node is None or name not in named or not isinstance(node, Tree) or node.data != "aggregate":
                continue
            for joints in (True, False):
                try:
                    numbers, _, _ = self._numbers(node, datum.file, joints=joints)
                except Unreadable:
                    continue
                if (datum.file, numbers[0].first) not in used:
                    reason = (
                        "no motion with plain arguments goes to it, so its tool and work object are unknown"
                    )
                    self.found.leave(line_of(node), name, reason, datum.file)


RAPID = Dialect(
    "RAPID of ABB",
    (".mod", ".modx", ".prg", ".sys", ".sysx"),
    RAPID_NOTATION,
    parse_rapid,
    configuration=QuadrantConfiguration(),
    zero=ArmAtZero(((0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0)), (0, 0, 1)),
    no_start="no joint positions stand before it, and configuration data do not count there (ConfJ, ConfL)",
)
"""RAPID: millimetres, degrees and quaternions."""
