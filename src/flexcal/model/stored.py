"""What identifications left on disk, put into a robot."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from flexcal.errors import InputError
from flexcal.estimates_file import Block, read_estimates
from flexcal.estimation import Estimate
from flexcal.model.robot_model import RobotModel

NUISANCE = re.compile(r".*\.(pose_[0-9]+|half_gap)")
"""Names of what was estimated for an experiment: not the robot's own."""


def apply_estimates(model: RobotModel, path: Path, *, without: Block | None = None) -> RobotModel:
    """`model` with every block of an estimates file but `without`, later blocks last; raises `InputError` as `with_blocks` does."""
    return with_blocks(model, read_estimates(path, without=without), path)


def with_blocks(model: RobotModel, blocks: Mapping[Block, Estimate], path: Path) -> RobotModel:
    """`model` with the estimates of `blocks`, which come from the file `path`.

    A joint whose backlash was estimated counts as declared to have backlash. Raises `InputError` for a name that the robot does not
    have: the file is then of another robot, or robot.yaml has changed since.
    """
    for block, estimate in blocks.items():
        unknown = [
            n for n in estimate.parameters.names if n not in model.values and not NUISANCE.fullmatch(n)
        ]
        if unknown:
            raise InputError(
                f"{path}: the block '{block}' has '{unknown[0]}', which the robot of {model.path} does not have; "
                "identify again, or give the robot.yaml that belongs to it."
            )
        model = _with_backlash_joints(model.with_estimate(estimate), estimate)
    return model


def _with_backlash_joints(model: RobotModel, estimate: Estimate) -> RobotModel:
    declared = set(model.config.geometry.backlash)
    found = [name for name in model.joint_names if f"{name}.backlash" in estimate.parameters]
    if declared.issuperset(found):
        return model
    joints = tuple(name for name in model.joint_names if name in declared.union(found))
    geometry = replace(model.config.geometry, backlash=joints)
    return replace(model, config=replace(model.config, geometry=geometry))
