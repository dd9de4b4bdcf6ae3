"""A cell of recorded files in a folder."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.data.experiments.folder import PLAN, POSES, existing_file, labels
from flexcal.data.plans import MultisinePlan, Plan, PosePlan, TrajectoryPlan, read_plan
from flexcal.data.poses import PoseSet, read_poses
from flexcal.data.recordings import FILL, Recording, read_recording
from flexcal.errors import InputError
from flexcal.files.formats import to_plain
from flexcal.files.transaction import refuse_mixture

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_SAME = 0.1
"""Distance of a measured pose from its planned one (rad or m) above which it is another pose."""


class FolderCell:
    """Cell of recorded files: a folder with `plan.yaml` and its measurements; see `flexcal.data.experiments.folder` for the names."""

    def __init__(self, path: str | Path, model: RobotModel) -> None:
        """Raises `InputError` where the folder is not there or its plan cannot be read or is for another robot."""
        self.path = Path(path)
        self.model = model
        require_measurements(self.path)
        self.plan: Plan = read_plan(self.path / PLAN)
        joints = self.plan.joint_count
        if joints != model.n:
            raise InputError(
                "E-EXP-006",
                f"{self.path / PLAN}: the plan is for {joints} joints, but the robot has {model.n}; check robot.yaml.",
            )

    def record(self, plan: MultisinePlan | TrajectoryPlan | None = None) -> Iterator[Recording]:
        """The recordings one by one, in the order of the plan (None: that of the folder).

        Raises `InputError`, before the first recording, where the folder holds another plan or a log is missing; and
        as `read_recording` does.
        """
        own = self.plan
        if isinstance(own, PosePlan):
            raise InputError(
                "E-EXP-007", f"{self.path / PLAN} is a plan of kind '{own.kind}', which has no joint logs."
            )
        self._check_same(plan)
        files = [(existing_file(self.path, label.name), label) for label in labels(own)]
        fill = FILL if isinstance(own, TrajectoryPlan) else 0.0
        return (read_recording(file, self.model, label, fill=fill) for file, label in files)

    def measure(self, plan: PosePlan | None = None) -> PoseSet:
        """The measured poses of `poses.csv` (or `.parquet`), approached as the plan says where the file does not say.

        Raises `InputError` where the folder holds another plan or the poses are not those of the plan, by number or by
        more than 0.1 rad (m), and as `read_poses` does.
        """
        own = self.plan
        if not isinstance(own, PosePlan):
            raise InputError(
                "E-EXP-008",
                f"{self.path / PLAN} is a plan of kind '{own.kind}', which has no measured poses.",
            )
        self._check_same(plan)
        file = existing_file(self.path, POSES)
        poses = read_poses(file, self.model, require_motion=False)
        first = np.sort(np.unique(poses.pose, return_index=True)[1])
        q = poses.q[first]
        planned = own.q[np.sort(np.unique(own.numbers, return_index=True)[1])]
        if len(q) != len(planned):
            raise InputError(
                "E-EXP-009",
                f"{file}: there are {len(q)} poses, but the plan has {len(planned)}; measure them all.",
            )
        apart = np.abs(q - planned)
        if apart.max() > _SAME:
            row, joint = (int(i) for i in np.argwhere(apart > _SAME)[0])
            raise InputError(
                "E-EXP-010",
                f"{file}, column q{joint + 1}: measured pose {poses.pose[first[row]]} lies {apart[row, joint]:.3g} from the planned one; "
                "measure in the order of the plan, or give the plan that was measured.",
            )
        if poses.approach is None and own.approach is not None and len(np.unique(own.numbers)) == len(own):
            _, begin, pose = np.unique(poses.pose, return_index=True, return_inverse=True)
            poses = replace(poses, approach=own.approach[np.argsort(np.argsort(begin))[pose]].astype(float))
        return poses

    def _check_same(self, plan: Plan | None) -> None:
        if plan is not None:
            require_same_plan(self.path / PLAN, self.plan, plan)


def require_measurements(folder: Path) -> None:
    """Raise `InputError` where `folder` is none, or holds files of a run that was cut off."""
    if not folder.is_dir():
        raise InputError(
            "E-EXP-005",
            f"{folder} is no folder; give the folder that holds {PLAN} and the measurements.",
        )
    refuse_mixture(folder)


def require_same_plan(path: Path, own: Plan, asked: Plan, free: tuple[str, ...] = ("name",)) -> None:
    """Raise `InputError` where the plan of `path` differs from another one, but for the `free` keys."""
    mine, yours = to_plain(own), to_plain(asked)
    keys = [key for key in {**mine, **yours} if key not in free and mine.get(key) != yours.get(key)]
    if keys:
        raise InputError(
            "E-EXP-011",
            f"{path} is another plan than the one asked for ({', '.join(keys)} differ); "
            "use the folder's own plan, or measure again.",
        )
