"""Calibrated position of a measured point, written to robot.yaml in place of the declared one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.errors import InputError
from flexcal.files.formats import read_yaml_file
from flexcal.jobs.setup.description_editing import edit_robot
from flexcal.model.robot import RobotConfig

_DIGITS = 6
"""Resolution of written positions, m: micrometres."""


class _Rounded(float):
    """Number that is written with all of its decimals."""

    def __repr__(self) -> str:
        return f"{self:.{_DIGITS}f}"


def write_point_position(robot_file: Path, name: str, xyz: np.ndarray) -> None:
    """Put `xyz` (3,) m in place of the `xyz` of the point `name` under `points:`; comments and all else are kept.

    Raises `InputError`, and changes nothing, where the file says it in a way that cannot be replaced.
    """
    place = [_Rounded(round(float(value), _DIGITS)) for value in xyz]
    declared = name in read_yaml_file(robot_file).structure(RobotConfig).points
    try:
        if declared:
            edit_robot(robot_file, {("points", name, "xyz"): place})
            return
    except InputError:
        pass
    raise InputError(
        "E-RUN-090",
        f"the xyz of the point '{name}' in {robot_file} could not be replaced; write xyz: {place} there by hand.",
    )
