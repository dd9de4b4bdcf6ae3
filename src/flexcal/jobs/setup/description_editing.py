"""Changes of single values of robot.yaml, with its comments kept."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import edited_yaml, parse_document, read_yaml_file
from flexcal.files.structuring import Keys, StructureError, structure
from flexcal.files.transaction import read_bytes, write_text
from flexcal.model.robot import RobotConfig


def edit_robot(robot_file: Path, changes: Mapping[Keys, Any]) -> None:
    """Set values of robot.yaml, or remove them where they are `REMOVED`; every other byte stays.

    Parameters
    ----------
    robot_file : Path
        The file.
    changes : mapping
        Plain data, SI units, or `REMOVED`, by the keys that lead there, as `("points", "smr", "xyz")`. What is missing on the way is
        added: `("payload",)` with a mapping makes the block. They are made in this order, all or none.

    Raises
    ------
    InputError
        With the file, and nothing changed: where it is not valid YAML, where a value cannot be changed alone, and where the changed
        file would not read as robot.yaml though it did before.
    """
    before = read_yaml_file(robot_file)
    text = read_bytes(robot_file).decode("utf-8")
    try:
        for keys, value in changes.items():
            text = edited_yaml(text, keys, value)
        _require_no_new_fault(before.data, text)
    except FlexcalError as problem:
        raise InputError(problem.code, f"{robot_file}: nothing was changed, because {problem}") from problem
    write_text(robot_file, text)


def _require_no_new_fault(before: Any, text: str) -> None:
    """Raise the first fault of the changed text that the file did not have."""
    known = {(fault.code, fault.keys) for fault in _faults(before)}
    data = parse_document(Path("robot.yaml"), text.removeprefix("\ufeff"))[0]
    for fault in _faults(data):
        if (fault.code, fault.keys) not in known:
            raise FlexcalError(fault.code, fault.sentence)


def _faults(data: Any) -> list[Any]:
    try:
        structure(data, RobotConfig)
    except StructureError as problem:
        return list(problem.failures)
    return []
