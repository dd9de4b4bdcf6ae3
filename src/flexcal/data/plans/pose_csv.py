"""A plan of poses as CSV: `pose`, `q1` … `qn` in rad (m where prismatic), and `payload` in kg where it is not the declared one.

Where it says from which side the joints come, `approach1` … `approachn`, and for the robot's program the way there, `via1` … `vian`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.data.plans.poses import PosePlan
from flexcal.data.poses import OF_COMMANDS, whole_numbers
from flexcal.data.tables import Table, open_table, write_table
from flexcal.errors import FlexcalError, InputError


def write_pose_table(path: Path, plan: PosePlan) -> None:
    """Write the poses in their order; the plan's name and seed are left out."""
    columns = {"pose": plan.numbers}
    columns |= {f"q{i + 1}": plan.q[:, i] for i in range(plan.joint_count)}
    if plan.payload is not None:
        columns["payload"] = plan.payload
    if plan.approach is not None:
        columns |= {f"approach{i + 1}": plan.approach[:, i] for i in range(plan.joint_count)}
        columns |= {f"via{i + 1}": plan.via[:, i] for i in range(plan.joint_count)}
    write_table(path, columns)


def read_pose_table(path: Path) -> PosePlan:
    """The poses in the order of the rows, named after the file.

    Commands that 'flexcal compensate' wrote are such a plan too. Raises `InputError` with file, line and column where something is wrong,
    and where the poses are not all of one `target`.
    """
    file = open_table(path)
    joints = tuple(f"q{i}" for i in range(1, sum(name.startswith("q") for name in file.columns) + 1))
    signs, ways = (tuple(f"{key}{i}" for i in range(1, len(joints) + 1)) for key in ("approach", "via"))
    sided = not {*signs, *ways}.isdisjoint(file.columns)
    for name in (*joints, *signs) if sided else joints or ("q1",):
        if name not in file.columns:
            raise file.error(
                "E-PLAN-024",
                f"the column '{name}' is missing; a plan of poses has pose, q1 … qn, and payload and approach1 … or not.",
            )
    for name in file.columns:
        if name not in ("pose", "payload", *OF_COMMANDS, *joints, *signs, *ways):
            raise file.error("E-PLAN-025", f"the column '{name}' is not known in a plan of poses; remove it.")
    texts = tuple(name for name in OF_COMMANDS if name in file.columns)
    table = file.read(texts)
    if "target" in texts and len(set(table.columns["target"].tolist())) > 1:
        raise file.error("E-PLAN-026", "the poses are of several targets; measure one target at a time.")
    pose = _numbers(table) if "pose" in file.columns else None
    try:
        return PosePlan(
            q=np.column_stack([table.columns[name] for name in joints]),
            payload=table.columns.get("payload"),
            name=path.stem,
            pose=pose,
            approach=np.column_stack([table.columns[name] for name in signs]) if sided else None,
        )
    except FlexcalError as problem:
        raise InputError(problem.code, f"{path}: {problem}") from problem


def _numbers(table: Table) -> np.ndarray | None:
    """The numbers (N,) of the poses; None where they only count from 1."""
    numbers = whole_numbers(table, "pose", table.columns["pose"])
    return None if np.array_equal(numbers, np.arange(1, len(numbers) + 1)) else numbers
