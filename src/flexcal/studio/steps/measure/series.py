"""The rows of a guided measurement as the project's folder has them, and what may be done with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import InputError
from flexcal.studio.project import CHECK_PLAN, CHECKED, MEASURED, PLAN, Project

if TYPE_CHECKING:
    from flexcal.data.plans import PosePlan
    from flexcal.data.poses import PoseSet
    from flexcal.jobs.guidance import MeasuredRow, MeasuredRows
    from flexcal.model.robot import RobotModel

_SAME = 0.01
"""Largest difference, rad or m, of a pose as measured from the planned one where the rows have no numbers of poses."""
_NEAR = 0.02
"""Largest difference, rad or m, of a pose as measured from the planned one of its number."""


@dataclass(frozen=True)
class Purpose:
    """What poses are measured for: the files of the plan and of the rows."""

    title: str
    plan: str
    rows: str

    @property
    def is_check(self) -> bool:
        """Whether the poses are reserved for verification."""
        return self.rows == CHECKED


PURPOSES = (Purpose("to calibrate on", PLAN, MEASURED), Purpose("to verify on", CHECK_PLAN, CHECKED))


@dataclass(frozen=True, eq=False)
class Series:
    """Plan and rows of one purpose at one moment.

    Attributes
    ----------
    plan : PosePlan or None
        Poses that are to be measured.
    rows : tuple of MeasuredRow
        Rows (N,) in the order of measuring, excluded ones too.
    poses : PoseSet or None
        The same N rows; None without any.
    numbers : ndarray
        Numbers (N,) of their poses.
    """

    purpose: Purpose
    model: RobotModel
    table: MeasuredRows
    plan: PosePlan | None
    rows: tuple[MeasuredRow, ...]
    poses: PoseSet | None
    numbers: np.ndarray

    @classmethod
    def read(cls, project: Project, purpose: Purpose, model: RobotModel, plan: PosePlan | None) -> Series:
        """Read the rows; raises `InputError` for a table that cannot be used."""
        from flexcal.jobs.guidance import MeasuredRows, RowReader

        table = MeasuredRows(project.folder, purpose.rows)
        rows = table.rows()
        if not rows:
            return cls(purpose, model, table, plan, (), None, np.zeros(0, dtype=int))
        poses = RowReader(table.path, table.columns, model).poses([row.cells for row in rows])
        numbers = poses.pose if "pose" in table.columns else _numbers(plan, poses.q)
        return cls(purpose, model, table, plan, rows, replace(poses, pose=numbers), numbers)

    @property
    def used(self) -> np.ndarray:
        """Rows (N,) that are not excluded."""
        return np.array([not row.excluded for row in self.rows], dtype=bool)

    @property
    def at_plan(self) -> np.ndarray:
        """Rows (N,) whose joint positions are those of the planned pose of their number."""
        plan, poses = self.plan, self.poses
        if plan is None or poses is None:
            return np.zeros(len(self.rows), dtype=bool)
        apart = np.abs(plan.q[None] - poses.q[:, None]).max(axis=2)
        same = plan.numbers[None] == self.numbers[:, None]
        return np.any(same & (apart < _NEAR), axis=1)

    @property
    def open_poses(self) -> np.ndarray:
        """Indices of the planned poses that have no row there yet, not even one that is excluded."""
        if self.plan is None:
            return np.zeros(0, dtype=int)
        return np.flatnonzero(~np.isin(self.plan.numbers, self.numbers[self.at_plan]))

    @property
    def free_number(self) -> int:
        """Number of the next pose that is not planned."""
        planned = [] if self.plan is None else self.plan.numbers.tolist()
        return max([*planned, *self.numbers.tolist()], default=0) + 1

    def check(self, rows: Sequence[Mapping[str, str]]) -> None:
        """Raise `InputError` for rows, texts by column, with cells that are no numbers, and without the columns that are needed."""
        from flexcal.jobs.guidance import RowReader

        RowReader(self.table.path, tuple(rows[0]), self.model).poses(rows)


def read_pose_plan(project: Project, purpose: Purpose, model: RobotModel) -> PosePlan | None:
    """Plan of the poses, None where there is none; raises `InputError` for one that cannot be used, and plans of something else."""
    from flexcal.data.plans import PosePlan
    from flexcal.jobs.inputs import read_plan_for_robot

    path = project.folder / purpose.plan
    if not path.is_file():
        return None
    plan = read_plan_for_robot(path, model)
    if not isinstance(plan, PosePlan):
        raise InputError(
            "E-STUDIO-033", f"{purpose.plan} is no plan of poses; plan them in step 2, or remove the file."
        )
    return plan


def stamp(project: Project, purpose: Purpose) -> tuple[object, object]:
    """State of the files of a series; equal ones mean that nothing changed."""
    return _status(project.folder / purpose.plan), _status(project.folder / purpose.rows)


def _status(path: Path) -> tuple[int, int, int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


def _numbers(plan: PosePlan | None, q: np.ndarray) -> np.ndarray:
    """Numbers (N,) of the planned poses at which rows without numbers were measured; further ones where they are at none."""
    further = (0 if plan is None else int(plan.numbers.max())) + np.arange(1, len(q) + 1)
    if plan is None:
        return further
    apart = np.abs(plan.q[None] - q[:, None]).max(axis=2)
    nearest = apart.argmin(axis=1)
    return np.where(apart.min(axis=1) < _SAME, plan.numbers[nearest], further)
