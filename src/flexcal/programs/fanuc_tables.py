"""Tools and user frames of a Fanuc controller, as it writes its system variables in ASCII (SYSFRAME.VA)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import InputError, naming
from flexcal.programs.notation import Notation
from flexcal.programs.orientation import RollPitchYaw
from flexcal.programs.pose import Pose
from flexcal.programs.program import ProgramFile
from flexcal.programs.syntax import whole_number
from flexcal.units import DEGREE

_NUMBER = r"\s*(-?(?:\d+\.?\d*|\.\d+))\s*"
_TABLE = re.compile(
    r"^\[\*SYSTEM\*\]\$MNU(FRAME|TOOL)\s[^\n]*\n(.*?)(?=^\[\*SYSTEM\*\]|\Z)", re.MULTILINE | re.DOTALL
)
_ENTRY = re.compile(r"\[1,(\d+)\]\s*=([^\[]*)")
_POSE = re.compile("".join(f"{key}:{_NUMBER}" for key in "XYZWPR"))
_KEYS = {"FRAME": "UF", "TOOL": "UT"}
_NOTATION = Notation(1e-3, DEGREE, RollPitchYaw((0, 1, 2)), 6)


@dataclass(frozen=True)
class FanucTables:
    """Poses of the user frames ("UF") in the world frame and of the tools ("UT") in the faceplate, of motion group 1, by number."""

    poses: dict[tuple[str, int], Pose]

    def pose(self, kind: str, number: int | None) -> Pose | None:
        """Pose of a user frame or tool; None where it is not known. Number 0 is the world frame and the faceplate."""
        if number == 0:
            return Pose.identity()
        return None if number is None else self.poses.get((kind, number))


def fanuc_tables(files: Sequence[ProgramFile]) -> FanucTables:
    """Tables in the files that end in .va; raises `InputError` for one without any."""
    poses: dict[tuple[str, int], Pose] = {}
    for file in files:
        if Path(file.name).suffix.lower() != ".va":
            continue
        tables = list(_TABLE.finditer(file.text.replace("\r\n", "\n")))
        if not tables:
            raise InputError(
                "E-PROG-014",
                f"{file.name} has no table MNUFRAME or MNUTOOL; give SYSFRAME.VA of the controller's backup.",
            )
        for table in tables:
            for entry in _ENTRY.finditer(table[2]):
                if numbers := _POSE.search(entry[2]):
                    values = [float(number) for number in numbers.groups()]
                    with naming(Path(file.name)):
                        poses[_KEYS[table[1]], whole_number(entry[1])] = _NOTATION.pose(values)
    return FanucTables(poses)
