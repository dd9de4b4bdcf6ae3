"""Tool, base and load that hold in a KRL program: $TOOL, $BASE and $LOAD, and the numbers of inline forms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from lark import Tree

from flexcal.programs.krl_data import KrlData, components, numbers_of, variable_name
from flexcal.programs.notation import Notation
from flexcal.programs.orientation import RollPitchYaw
from flexcal.programs.pose import Pose
from flexcal.programs.syntax import (
    Node,
    Statement,
    between_commas,
    is_tree,
    name_of,
    whole_number,
    written_number,
)
from flexcal.units import DEGREE, MILLIMETRE

KRL_NOTATION = Notation(MILLIMETRE, DEGREE, RollPitchYaw((2, 1, 0)), 6)
"""X, Y, Z in millimetres, A, B, C in degrees."""
POSE = ("x", "y", "z", "a", "b", "c")
_NULL = ("nullframe", "$nullframe")
_OF_FORM = ("#ptp_params", "#cp_params", "#frames")
"""Calls of BAS that take tool and base of FDAT_ACT."""


@dataclass(frozen=True)
class Setting:
    """A frame that is set: `known`, or None and what is wrong with it; and its mass, kg, for a tool whose load is in the text."""

    known: Pose | None
    wrong: str = ""
    mass: float | None = None

    def same(self, other: Setting) -> bool:
        """Whether both are the same frame."""
        if self.known is None or other.known is None:
            return self.wrong == other.wrong and self.known is other.known
        return self.known.equals(other.known) and self.mass == other.mass


@dataclass(frozen=True)
class KrlFrames:
    """Tool and base that hold at a line, None where its routine has set none; and why none of the arm's tools moves there, or empty."""

    data: KrlData
    tool: Setting | None = None
    base: Setting | None = None
    outside: str = ""
    form: tuple[Node, int] | None = None
    """Data of the inline form (FDAT_ACT), and the index of their file."""

    def after(self, statement: Statement) -> KrlFrames:
        """Frames that hold behind a line."""
        nodes = statement.nodes
        names = [name_of(node) for node in nodes]
        if "def" in names or "deffct" in names:
            return KrlFrames(self.data)
        if len(nodes) > 2 and nodes[1] == "=":
            if names[0] == "fdat_act":
                return replace(self, form=self.data.value(nodes[2:], statement.file))
            return self.set(names[0], nodes[2:], statement.file)
        if len(nodes) > 2 and nodes[1] == "." and names[0] in ("$tool", "$base"):
            return replace(self, **{names[0][1:]: Setting(None, f"{names[0].upper()} is set by parts")})
        if names[0] == "bas" and len(nodes) == 2 and isinstance(nodes[1], Tree):
            given = between_commas(nodes[1].children)
            command = "".join(str(node).lower() for node in given[0])
            number = written_number(given[1], statement.file) if len(given) > 1 else None
            if command in _OF_FORM:
                return self._by_form(self.form)
            if command in ("#tool", "#base"):
                kind, index = command[1:], None if number is None else int(number.value)
                return replace(self, **{kind: self._numbered(kind, index, statement.file)})
            if command == "#ex_base":
                return replace(self, base=Setting(None, "an external kinematic system carries the base"))
        return self

    def set(self, name: str, value: Sequence[Node], file: int) -> KrlFrames:
        """Frames after the assignment of a value to a system variable, in a line or behind WITH."""
        called = name_of(value[0]) if len(value) == 2 and is_tree(value[1], "group") else ""
        inner = value[1].children if called and isinstance(value[1], Tree) else []
        if name == "$tool":
            if called in ("stool", "stool2"):
                form = self.data.value(inner[:1], file)
                return replace(self, tool=self._by_form(form).tool, outside=self._by_form(form).outside)
            return replace(self, tool=self._value("tool", value, file))
        if name == "$base":
            if called == "ek":
                return replace(self, base=Setting(None, "an external kinematic system carries the base"))
            if called == "sbase" and inner:
                number = written_number(inner, file)
                if number is not None:
                    return replace(self, base=self._numbered("base", int(number.value), file))
                return replace(self, base=self._by_form(self.data.value(inner[:1], file)).base)
            return replace(self, base=self._value("base", value, file))
        if name == "$load" and self.tool is not None and called != "sload":
            number = _mass(self.data.value(list(value), file))
            return replace(self, tool=replace(self.tool, mass=number))
        if name == "$ipo_mode" and len(value) == 2 and name_of(value[1]) in ("tcp", "base"):
            stands = name_of(value[1]) == "tcp"
            return replace(self, outside="the tool stands still ($IPO_MODE is #TCP)" if stands else "")
        return self

    def _by_form(self, form: tuple[Node, int] | None) -> KrlFrames:
        """Frames of the data of an inline form."""
        if form is None:
            wrong = "the data of its inline form (FDAT) are not in the files given"
            return replace(self, tool=Setting(None, wrong), base=Setting(None, wrong), outside="")
        parts = components(form[0])
        numbers = [written_number(parts.get(name, []), form[1]) for name in ("tool_no", "base_no")]
        tool, base = (
            self._numbered(kind, None if number is None else int(number.value), form[1])
            for kind, number in zip(("tool", "base"), numbers, strict=True)
        )
        stands = [name_of(node) for node in parts.get("ipo_frame", [])][-1:] == ["tcp"]
        outside = "the tool stands still (IPO_FRAME is #TCP)" if stands else ""
        return replace(self, tool=tool, base=base, outside=outside)

    def _numbered(self, kind: str, index: int | None, file: int) -> Setting:
        """Tool or base of a number, with its load."""
        if index is None:
            return Setting(None, f"the number of its {kind} is computed")
        if index == 0:
            return Setting(Pose.identity())
        name = f"{kind}_data[{index}]"
        variable = self.data.find(name, file)
        if variable is None:
            return Setting(None, f"{name.upper()} is not in the files given: give $config.dat too")
        if variable.value is None:
            return Setting(None, f"{name.upper()} is set more than once")
        load = self.data.find(f"load_data[{index}]", file)
        mass = None if load is None or load.value is None else _mass((load.value, load.file))
        known = _pose((variable.value, variable.file))
        wrong = "" if known is not None else f"{name.upper()} is not written as numbers"
        return Setting(known, wrong, mass if kind == "tool" else None)

    def _value(self, kind: str, value: Sequence[Node], file: int) -> Setting:
        name = variable_name(value)
        if name in _NULL:
            return Setting(Pose.identity())
        if name.startswith(f"{kind}_data["):
            return self._numbered(kind, whole_number(name.split("[")[1][:-1]), file)
        found = self.data.value(list(value), file)
        known = None if found is None else _pose(found)
        return Setting(
            known, "" if known is not None else f"${kind.upper()} is computed when the program runs"
        )


def _pose(value: tuple[Node, int]) -> Pose | None:
    numbers = numbers_of(*value, POSE)
    return None if numbers is None else KRL_NOTATION.pose([number.value for number in numbers])


def _mass(value: tuple[Node, int] | None) -> float | None:
    """Mass of {M …}, kg; None where it is negative, which means the controller's default."""
    numbers = None if value is None else numbers_of(*value, ("m",))
    return None if numbers is None or not np.all(numbers[0].value >= 0) else numbers[0].value
