"""Where an accuracy map is computed."""

from __future__ import annotations

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.files.formats import read_yaml_file
from flexcal.jobs.result_files import read_arm
from flexcal.model.robot import RobotConfig
from flexcal.studio.project import CALIBRATION, Project, pose_files

_MARGIN = 0.05
"""Around measured points, m."""
_ROUND = 0.01


def working_places(project: Project) -> dict[str, tuple[str, ...]]:
    """Options of `flexcal map` by what they mean: the declared volume, a box around the measured points, measured poses, everywhere."""
    places: dict[str, tuple[str, ...]] = {}
    if _declares_volume(project):
        places["the working volume of robot.yaml"] = ()
    box = _measured_box(project)
    if box:
        # a box may begin with a minus sign, which would be taken for an option
        places["a box around the measured points"] = (f"--working={box}",)
    for name in pose_files(project):
        places[f"the poses of {name}"] = (f"--working={name}",)
    if not _declares_volume(project):
        places["wherever the joints let it go"] = ()
    return places


def _declares_volume(project: Project) -> bool:
    try:
        return read_yaml_file(project.robot_file).structure(RobotConfig).working_volume is not None
    except FlexcalError:
        return False


def _measured_box(project: Project) -> str:
    try:
        tip = read_arm(project.folder / CALIBRATION).tip
    except (FlexcalError, OSError):
        return ""
    lower = np.floor((tip.min(axis=0) - _MARGIN) / _ROUND) * _ROUND
    upper = np.ceil((tip.max(axis=0) + _MARGIN) / _ROUND) * _ROUND
    return ",".join(f"{a:.2f}:{b:.2f}" for a, b in zip(lower, upper, strict=True))
