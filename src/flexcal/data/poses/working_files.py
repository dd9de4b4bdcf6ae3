"""Files of working poses or points: CSV or Parquet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.poses.columns import first_point, target_column, without_ways
from flexcal.data.poses.target_files import OF_COMMANDS
from flexcal.data.tables import Table, assign, check_joint_limits, check_joint_units, open_table

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel


def read_working(path: Path, model: RobotModel) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Working poses (W, n), rad, of a file with `pose` and `q1`…, else working points (W, 3), m, robot's base frame, of one with x, y, z.

    A column `target` may name the point of each row, as in a file of targets or of commands. Raises `InputError` with file, line and
    column for what is missing or not understood, for a pose outside the joint limits, and for x, y, z of another point than the first
    one under `points:`, which maps and designs are of.
    """
    file = without_ways(open_table(path), model)
    texts = tuple(name for name in OF_COMMANDS if name in file.columns)
    if {"x", "y", "z"} <= set(file.columns) and "q1" not in file.columns:
        signals = assign(file, model, ("xyz",), ("pose",), texts)
        table = file.read(texts)
        if "target" in texts:
            _require_first_point(table, model)
        return None, signals["xyz"].values(table)
    signals = assign(file, model, ("pose", "q"), ("xyz", "payload", "approach"), texts)
    table = file.read(texts)
    if "target" in texts:
        target_column(table, model)
    q = signals["q"].values(table)
    check_joint_units(model, table, signals["q"], q)
    columns = [signals["q"].column_of(joint) for joint in range(model.n)]
    check_joint_limits(model, table, np.arange(len(q)), columns, q)
    return q, None


def _require_first_point(table: Table, model: RobotModel) -> None:
    first = first_point(table.file, model)
    other = target_column(table, model) != first
    if other.any():
        row = int(np.argmax(other))
        named = table.columns["target"][row]
        raise table.error(
            "E-POSES-036",
            row,
            "target",
            f"working points are those of {first}, the first under `points:`, not of {named}; remove the row, or give q1…q{model.n}.",
        )
