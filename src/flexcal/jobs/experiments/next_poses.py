"""Selection of the next poses after measured ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.plans import PosePlan
from flexcal.data.poses import PosePool, read_poses
from flexcal.design.poses import NextPoses, WorkingVolume, select_next_poses
from flexcal.jobs.experiments.candidate_poses import CandidatePoses, PoseRequest
from flexcal.jobs.experiments.poses import flank_block, pool_block, working_block, write_pose_plan
from flexcal.jobs.inputs import robot_provenance
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False)
class NextPosesPlan:
    """The next poses, best first, up to where to stop; `plan` and `file` are None where nothing is left to measure.

    `pool` are the given poses they were chosen from, if any; else `seed` drew the random ones.
    """

    plan: PosePlan | None
    file: Path | None
    poses: NextPoses
    stop: int | None
    wanted: float | None
    seed: int
    working: WorkingVolume | None = None
    pool: PosePool | None = None
    record: RunRecord = NOT_RECORDED

    def document(self) -> dict[str, Any]:
        """The JSON document; `stop_after` counts the next poses, and is null where those asked for do not suffice."""
        poses, design = self.poses, self.poses.design
        return (
            {
                "plan": self.file,
                "poses": 0 if self.plan is None else len(self.plan),
                "measured": poses.measured,
            }
            | pool_block(design, self.pool, self.seed)
            | {
                "criterion": design.criterion.name,
                "candidates": len(design.candidates),
                "wanted_mm": None if self.wanted is None else self.wanted / MILLIMETRE,
                "stop_after": self.stop,
                "working": working_block(self.working),
                "flanks": flank_block(design),
                "tool_error_mm": poses.tool_error / MILLIMETRE,
                "least_possible_mm": poses.possible / MILLIMETRE,
                **self.record.document(),
            }
        )


def plan_next_poses(
    robot: Path,
    out: Path,
    request: PoseRequest,
    *,
    measured: Sequence[Path],
    command: str = "",
    progress: Progress = silent,
) -> NextPosesPlan:
    """Write to `out` the next poses, after the files of `measured` ones; nothing where these are enough.

    They end where the predicted tool error is the wanted one, or without it where more poses only average. Raises `FlexcalError` as
    `select_next_poses`, `read_poses`, `read_pose_pool` and `working_volume` do.
    """
    model, count, wanted = RobotModel.from_yaml(robot), request.count, request.wanted
    known = read_poses(measured, model, require_motion=False)
    rng = np.random.default_rng([request.seed, 7])
    choice = CandidatePoses.of(model, request, rng, progress)
    after = select_next_poses(choice.candidates, known, count, rng=rng, criterion=request.criterion)
    stop = after.enough(wanted)
    origin = robot_provenance(model, (*measured, *choice.files))
    if stop == 0:
        return NextPosesPlan(
            None,
            None,
            after,
            stop,
            wanted,
            request.seed,
            choice.working,
            choice.pool,
            RunRecord(origin, command),
        )
    design = after.design.in_order(np.arange(count if stop is None else stop))
    plan = replace(design.plan, name="calibration")
    after = replace(after, design=design)
    result = NextPosesPlan(
        plan, out, after, stop, wanted, request.seed, choice.working, choice.pool, RunRecord(origin, command)
    )
    write_pose_plan(out, model, plan, result.document(), choice.working)
    return result
