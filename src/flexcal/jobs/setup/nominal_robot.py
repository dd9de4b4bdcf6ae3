"""The robot of a URDF without robot.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flexcal.files.formats import YamlFile
from flexcal.model.robot import RobotModel, read_robot
from flexcal.model.urdf import find_arm


def urdf_robot(urdf: Path, tip: str | None = None) -> RobotModel:
    """Robot that the robot.yaml of `init_robot` would describe, without points; nothing is written.

    `tip`: the link where the arm ends, for a URDF with several arms.

    Raises `InputError` as `find_arm` and reading a robot do.
    """
    arm = find_arm(urdf, tip)
    data: dict[str, Any] = {"robot": urdf.name, "locked": arm.locked, "motors": list(arm.motors)}
    return read_robot(RobotModel, YamlFile(urdf.with_name("robot.yaml"), data, {}))
