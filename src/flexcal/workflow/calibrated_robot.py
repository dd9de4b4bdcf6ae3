"""The robot with its calibration, for the verbs that use it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from flexcal.data import read_estimates
from flexcal.errors import InputError
from flexcal.estimates_file import Block
from flexcal.estimation import Estimate
from flexcal.model import RobotModel
from flexcal.model.stored import with_blocks


@dataclass(frozen=True, eq=False)
class CalibratedRobot:
    """`nominal` as robot.yaml and URDF have it, `model` with the `blocks` of the estimates in the file `stored`."""

    nominal: RobotModel
    model: RobotModel
    stored: Path
    blocks: Mapping[Block, Estimate]


def calibrated_robot(robot: Path, estimates: Path | None, task: str) -> CalibratedRobot:
    """Read a robot and its estimates: a file, or a folder with an estimates.yaml, in place of that beside robot.yaml.

    Raises `FlexcalError` as reading does, and `InputError` where there is no calibration, and so nothing to `task`.
    """
    nominal = RobotModel.from_yaml(robot, estimates=False)
    stored = nominal.path.parent / nominal.config.estimates if estimates is None else estimates
    stored = stored / "estimates.yaml" if stored.is_dir() else stored
    if not stored.exists():
        raise InputError(
            f"{stored} does not exist, so there is nothing to {task}; run 'flexcal calibrate {nominal.path} POSES…' first."
        )
    blocks = read_estimates(stored)
    if "calibration" not in blocks:
        raise InputError(
            f"{stored}: there is no calibration in it; run 'flexcal calibrate {robot} POSES…' first."
        )
    return CalibratedRobot(nominal, with_blocks(nominal, blocks, stored), stored, blocks)
