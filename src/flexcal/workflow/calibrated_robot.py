"""The robot with its calibration, for the verbs that use it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import InputError
from flexcal.estimates_file import Block, read_estimates
from flexcal.estimation import Estimate
from flexcal.model import RobotModel
from flexcal.model.stored import with_blocks
from flexcal.workflow.stored_block import ESTIMATES


@dataclass(frozen=True, eq=False)
class CalibratedRobot:
    """`nominal` as robot.yaml and URDF have it, `model` with the `blocks` of the estimates in the file `stored`."""

    nominal: RobotModel
    model: RobotModel
    stored: Path
    blocks: Mapping[Block, Estimate]


def stored_estimates(nominal: RobotModel, estimates: Path | None) -> Path:
    """The estimates.yaml of a robot: that named or in the folder named, else that beside robot.yaml."""
    stored = nominal.path.parent / nominal.config.estimates if estimates is None else estimates
    return stored / ESTIMATES if stored.is_dir() else stored


def found_station(model: RobotModel, station: str) -> bool:
    """Whether the calibration found where the instrument stood."""
    return f"station.{station}.x" in model.posterior.parameters


def calibrated_robot(robot: Path, estimates: Path | None, task: str) -> CalibratedRobot:
    """Read a robot and its estimates: a file, or a folder with an estimates.yaml, in place of that beside robot.yaml.

    Raises `FlexcalError` as reading does, and `InputError` where there is no calibration, and so nothing to `task`.
    """
    nominal = RobotModel.from_yaml(robot, estimates=False)
    stored = stored_estimates(nominal, estimates)
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
