"""MoveIt's joint_limits.yaml with positions that stay where they are on the real arm while its zeros move."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from flexcal.errors import InputError
from flexcal.export.wanted_numbers import KEPT, number_text
from flexcal.export.xacro_numbers import yaml_numbers
from flexcal.export.xml_text import Edit, edited

_TABLE = "joint_limits"
_POSITIONS = ("min_position", "max_position")


def shifted_limits(
    path: Path, content: bytes, offsets: Mapping[str, float]
) -> tuple[bytes, tuple[str, ...], tuple[str, ...]]:
    """The file with the offsets (rad or m) of the joints added to its positions, what changed, and joints without positions there.

    All other bytes are kept. Raises `InputError` where the file is no YAML, or has no table of joint limits.
    """
    table = [
        (keys[-2], keys[-1], number)
        for keys, number in yaml_numbers(path, content)
        if len(keys) >= 3 and keys[-3] == _TABLE
    ]
    if not table:
        raise InputError(
            "E-ROS-015", f"{path}: there is no number under `{_TABLE}:`; name MoveIt's {_TABLE}.yaml."
        )
    edits: list[Edit] = []
    said: list[str] = []
    for joint, key, number in sorted(table, key=lambda entry: entry[2].first):
        if key in _POSITIONS and abs(offsets.get(joint, 0.0)) > KEPT:
            value = number.value + offsets[joint]
            edits.append(Edit(path, number.first, number.end, number_text(value)))
            said.append(f"line {number.line}: {key} of {joint}")
    having = {joint for joint, key, _ in table if key in _POSITIONS}
    left = tuple(joint for joint, offset in offsets.items() if abs(offset) > KEPT and joint not in having)
    return edited({path: content}, edits).get(path, content), tuple(said), left
