"""Selection of the next poses after measured ones."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.plans import PosePlan, page_beside, write_plan
from flexcal.data.poses import PosePool, PoseSet, read_poses
from flexcal.design.poses import NextPoses, WorkingVolume, select_next_poses
from flexcal.errors import FlexcalError, naming
from flexcal.jobs.experiments.candidate_poses import (
    DEFAULT_REQUEST,
    CandidatePoses,
    PoseRequest,
    PoseRequestFiles,
)
from flexcal.jobs.experiments.poses import (
    approach_block,
    flank_block,
    plan_page,
    pool_block,
    with_approaches,
    working_block,
)
from flexcal.jobs.inputs import robot_provenance
from flexcal.jobs.pages import PlottedResult
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.layout import Page
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False, repr=False)
class DesignedNextPoses(PlottedResult):
    """Result of `design_next_poses`: the next poses to measure, best first, and a stopping rule.

    Attributes
    ----------
    model : RobotModel
        The robot that the plan is for.
    plan : PosePlan or None
        The next poses up to where to stop; None where nothing is left to measure.
    poses : NextPoses
        The next poses with the tool error predicted after each.
    stop : int or None
        Number of poses after which to stop; None where those asked for do not suffice.
    desired_error : float or None
        Predicted tool error, m, at which no more poses are taken.
    seed : int
        Seed of the random poses, where none were given.
    working : WorkingVolume or None
        Where the tool error counts; None for anywhere.
    pool : PosePool or None
        Given poses that these were chosen from.
    file : Path or None
        File of the plan, where it was written.
    record : RunRecord
        What the result comes from.
    """

    plan: PosePlan | None
    poses: NextPoses
    stop: int | None
    desired_error: float | None
    seed: int
    working: WorkingVolume | None = None
    pool: PosePool | None = None
    file: Path | None = None
    record: RunRecord = NOT_RECORDED

    @property
    def headline(self) -> str:
        """Number of poses and predicted tool error."""
        errors = self.poses.tool_error / MILLIMETRE
        count = 0 if self.plan is None else len(self.plan)
        return f"{count} more poses after {self.poses.measured}, predicted tool error {errors[0]:.4f} mm now, {errors[count]:.4f} mm then"

    def summary(self) -> str:
        """Predicted tool error now and after the next poses."""
        return self.headline

    def _page(self) -> Page:
        if self.plan is None:
            raise FlexcalError("E-RUN-096", "no more poses are needed, so there is no plan to show.")
        return plan_page(self.model, self.plan, self.document(), self.working)

    def document(self) -> dict[str, Any]:
        """The JSON document; `stop_after` counts the next poses, and is null if the requested ones do not suffice."""
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
                "wanted_mm": None if self.desired_error is None else self.desired_error / MILLIMETRE,
                "stop_after": self.stop,
                "working": working_block(self.working),
                "flanks": flank_block(design),
                "approaches": {} if self.plan is None else approach_block(self.model, self.plan),
                "tool_error_mm": poses.tool_error / MILLIMETRE,
                "least_possible_mm": poses.possible / MILLIMETRE,
                **self.record.document(),
            }
        )


def design_next_poses(
    model: RobotModel,
    measured: PoseSet,
    request: PoseRequest = DEFAULT_REQUEST,
    *,
    progress: Progress = silent,
) -> DesignedNextPoses:
    """Choose the next poses to measure, best first, with a stopping rule.

    Parameters
    ----------
    model : RobotModel
        Robot with what is known of it without these measurements.
    measured : PoseSet
        Poses (N, n) that are measured already.
    request : PoseRequest
        How many poses at most, by which criterion (c, A or D), from which candidates; they end where the predicted tool error is the
        desired one, or without that where more poses only average noise.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    DesignedNextPoses
        Its `plan` (None where those measured are enough), `stop`, `summary()` and `report(path)`.

    Raises
    ------
    FlexcalError
        For another criterion, too few candidates, and poses measured with another target or from another station.

    Examples
    --------
    >>> from flexcal import PoseRequest, RobotModel, design_next_poses, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> measured = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 53))
    >>> design = design_next_poses(model, measured, PoseRequest(count=4, candidates=60))
    >>> design.plan.q.shape
    (4, 6)
    """
    rng = np.random.default_rng([request.seed, 7])
    return _designed(CandidatePoses.of(model, request, rng, progress), measured, request, rng)


def _designed(
    choice: CandidatePoses, measured: PoseSet, request: PoseRequest, rng: np.random.Generator
) -> DesignedNextPoses:
    after = select_next_poses(
        choice.candidates, measured, request.count, rng=rng, criterion=request.criterion
    )
    stop, plan = after.enough(request.desired_error), None
    if stop != 0:
        design = after.design.in_order(np.arange(request.count if stop is None else stop))
        plan = with_approaches(choice.checker, replace(design.plan, name="calibration"), request.seed)
        after = replace(after, design=design)
    model = choice.checker.model
    return DesignedNextPoses(
        model, plan, after, stop, request.desired_error, request.seed, choice.working, choice.pool
    )


def plan_next_poses(
    robot_file: Path,
    out: Path,
    request: PoseRequest,
    files: PoseRequestFiles,
    *,
    measured: Sequence[Path],
    command: str = "",
    progress: Progress = silent,
) -> DesignedNextPoses:
    """`design_next_poses` for the robot of a robot.yaml after the files `measured`; the plan goes to `out`, if given.

    Raises `FlexcalError` as `design_next_poses`, `read_poses` and reading the `files` do.
    """
    model = RobotModel.from_yaml(robot_file)
    known = read_poses(measured, model, require_motion=False)
    request = files.read(model, request)
    rng = np.random.default_rng([request.seed, 7])
    with nullcontext() if files.pool is None else naming(files.pool):
        choice = CandidatePoses.of(model, request, rng, progress)
    designed = _designed(choice, known, request, rng)
    record = RunRecord(robot_provenance(model, (*measured, *files.paths)), command)
    result = replace(designed, record=record, file=None if designed.plan is None else out)
    if result.plan is not None:
        write_plan(out, result.plan)
        result.report(page_beside(out))
    return result
