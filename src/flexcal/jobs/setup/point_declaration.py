"""Calibrated position of a measured point, written to robot.yaml in place of the declared one."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from flexcal.errors import InputError
from flexcal.files.formats import read_yaml_file
from flexcal.files.transaction import current_path, write_text
from flexcal.model.robot import RobotConfig

_DIGITS = 6
"""Resolution of written positions, m: micrometres."""


def write_point_position(robot_file: Path, name: str, xyz: np.ndarray) -> None:
    """Put `xyz` (3,) m in place of the `xyz` of the point `name` under `points:`; comments and all else are kept.

    Raises `InputError`, and changes nothing, where the file says it in a way that cannot be replaced.
    """
    text = current_path(robot_file).read_text(encoding="utf-8")
    before = read_yaml_file(robot_file).structure(RobotConfig)
    place = tuple(round(float(value), _DIGITS) for value in xyz)
    told = ", ".join(f"{value:.{_DIGITS}f}" for value in place)
    block = re.search(r"^points:.*?(?=^\S|\Z)", _blanked(text), flags=re.MULTILINE | re.DOTALL)
    own = re.compile(rf"(?:^|[\s{{,])[\"']?{re.escape(name)}[\"']?\s*:", flags=re.MULTILINE)
    entry = None if block is None else own.search(_blanked(text), block.start(), block.end())
    match = None
    if entry is not None and block is not None:
        match = re.compile(r"\bxyz\s*:\s*(\[[^\]]*\])").search(_blanked(text), entry.end(), block.end())
    if match is not None:
        changed = f"{text[: match.start(1)]}[{told}]{text[match.end(1) :]}"
        expected = replace(before, points=before.points | {name: replace(before.points[name], xyz=place)})
        write_text(robot_file, changed)
        if _structured(robot_file) == expected:
            return
        write_text(robot_file, text)
    raise InputError(
        "E-RUN-090",
        f"the xyz of the point '{name}' in {robot_file} could not be replaced; write xyz: [{told}] there by hand.",
    )


def _blanked(text: str) -> str:
    """Text with comments blanked, every character in its place."""
    return re.sub(r"(?:(?<=\s)|^)#[^\n]*", lambda match: " " * len(match[0]), text, flags=re.MULTILINE)


def _structured(robot_file: Path) -> RobotConfig | None:
    try:
        return read_yaml_file(robot_file).structure(RobotConfig)
    except InputError:
        return None
