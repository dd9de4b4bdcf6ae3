"""A plan of poses as CSV: `pose`, `q1` … `qn` in rad (m where prismatic), and `payload` in kg where it is not the declared one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.data.pose_plan import PosePlan
from flexcal.data.table import open_table, write_table
from flexcal.errors import FlexcalError, InputError


def write_pose_table(path: Path, plan: PosePlan) -> None:
    """Write the poses in their order, numbered from 1; the plan's name and seed are left out."""
    columns = {"pose": np.arange(1, len(plan) + 1)}
    columns |= {f"q{i + 1}": plan.q[:, i] for i in range(plan.joint_count)}
    write_table(path, columns if plan.payload is None else columns | {"payload": plan.payload})


def read_pose_table(path: Path) -> PosePlan:
    """The poses in the order of the rows, named after the file; raises `InputError` with file, line and column where something is wrong."""
    file = open_table(path)
    joints = tuple(f"q{i}" for i in range(1, sum(name.startswith("q") for name in file.columns) + 1))
    for name in joints or ("q1",):
        if name not in file.columns:
            raise file.error(
                f"the column '{name}' is missing; a plan of poses has pose, q1 … qn, and payload or not."
            )
    for name in file.columns:
        if name not in ("pose", "payload", *joints):
            raise file.error(f"the column '{name}' is not known in a plan of poses; remove it.")
    table = file.read()
    try:
        return PosePlan(
            q=np.column_stack([table.columns[name] for name in joints]),
            payload=table.columns.get("payload"),
            name=path.stem,
        )
    except FlexcalError as problem:
        raise InputError(f"{path}: {problem}") from problem
