"""Cells of the demonstration: the virtual cell and the hard cell."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from flexcal.data.experiments import Cell
from flexcal.data.plans import PosePlan
from flexcal.errors import FlexcalError
from flexcal.files.formats import read_yaml
from flexcal.hard_cell import HardCell, counterparts
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell import CellConfig, VirtualCell, write_truth

CellName = Literal["virtual", "hard"]
"""Name of the demonstration's cell."""


class KnownCell(Cell, Protocol):
    """Cell with known true values, for comparison at the end."""

    def noise_free(self, plan: PosePlan) -> np.ndarray:
        """True positions (N, 3) m of the point at every pose in the instrument's frame, for verification only."""
        ...


def open_cell(
    kind: CellName,
    robot_file: Path,
    nominal: RobotModel,
    *,
    truth: Path | None,
    hidden: Path,
    seed: int,
    config: CellConfig | None = None,
) -> KnownCell:
    """Cell with the robot of `robot_file`; the true values of the model's parameters are written to the file `hidden`.

    A virtual cell has the settings `config`, by default those of cell.yaml. The values are drawn from `seed`, or those of the file `truth`;
    of a hard robot only those that have a counterpart in the model. Raises `FlexcalError` where the cell cannot hold the robot, and for a
    `truth` of a hard one.
    """
    if kind == "hard":
        if truth is not None:
            raise FlexcalError(
                "E-RUN-093",
                "a hard cell's robot has no truth in the form of estimates.yaml; leave out --truth or --cell hard.",
            )
        cell = HardCell.drawn(robot_file, seed)
        write_truth(hidden, counterparts(cell.robot))
        return cell
    settings = read_yaml(robot_file.parent / "cell.yaml", CellConfig) if config is None else config
    cell, values = VirtualCell.drawn(nominal, settings, seed, truth)
    write_truth(hidden, values)
    return cell
