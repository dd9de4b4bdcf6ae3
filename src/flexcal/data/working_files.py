"""Files of working poses or points: CSV or Parquet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.joint_limits import check_joint_limits, check_joint_units
from flexcal.data.signals import assign
from flexcal.data.table import open_table

if TYPE_CHECKING:
    from flexcal.model import RobotModel


def read_working(path: Path, model: RobotModel) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Working poses (W, n), rad, of a file with `pose` and `q1`…, else working points (W, 3), m, robot's base frame, of one with x, y, z.

    Raises `InputError` with file, line and column for what is missing or not understood, and for a
    pose outside the joint limits.
    """
    file = open_table(path)
    if {"x", "y", "z"} <= set(file.columns) and "q1" not in file.columns:
        signals = assign(file, model, ("xyz",), ("pose",))
        return None, signals["xyz"].values(file.read())
    signals = assign(file, model, ("pose", "q"), ("xyz", "payload"))
    table = file.read()
    q = signals["q"].values(table)
    check_joint_units(model, table, signals["q"], q)
    columns = [signals["q"].column_of(joint) for joint in range(model.n)]
    check_joint_limits(model, table, np.arange(len(q)), columns, q)
    return q, None
