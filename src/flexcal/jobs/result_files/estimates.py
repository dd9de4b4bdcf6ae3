"""Path of the file of an identification's estimate."""

from __future__ import annotations

import os
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.formats import Block, require_place
from flexcal.files.transaction import refuse_linked_folder
from flexcal.model.robot import RobotModel

ESTIMATES = "estimates.yaml"


def estimates_target(model: RobotModel, out: Path | None, block: Block, given: Path | None = None) -> Path:
    """Path of the file for an identification's block: in the folder `out`, else the one that was `given`, else the robot's own.

    Raises `InputError` where that cannot take the block, as one that another program wrote, and where robot.yaml names a file outside of
    its folder, where a verb writes only what the command line names.
    """
    target = given or model.estimates_file if out is None else out / ESTIMATES
    if out is None and given is None:
        folder = model.path.parent
        if not Path(os.path.abspath(target)).is_relative_to(os.path.abspath(folder)):
            raise InputError(
                "E-RUN-112",
                f"{model.path} names a file of estimates outside of {folder}, where nothing is written; name the folder with --out.",
            )
        refuse_linked_folder(target, folder)
    require_place(target, block)
    return target
