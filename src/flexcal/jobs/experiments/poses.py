"""Selection of calibration or verification poses."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.diagnostics import EnoughPoses
from flexcal.calibration.fit import FleetPrior
from flexcal.data.plans import PosePlan, page_beside, write_plan
from flexcal.data.poses import PosePool
from flexcal.design.optimality import TraceOptimal, greedy
from flexcal.design.poses import (
    MeasurementOrder,
    PoseCurve,
    PoseDesign,
    WorkingVolume,
    blocked_ways,
    choose_poses,
    crossed_approaches,
    enough_with_prior,
    fewest_poses,
    measurement_order,
    pose_curve,
    random_poses,
    tool_error,
    zero_stds,
)
from flexcal.design.scene import CollisionChecker, MeasuringSetup
from flexcal.errors import naming
from flexcal.jobs.experiments.candidate_poses import (
    DEFAULT_REQUEST,
    CandidatePoses,
    PoseRequest,
    PoseRequestFiles,
)
from flexcal.jobs.inputs import robot_provenance
from flexcal.jobs.pages import PlottedResult
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, identifiability_block
from flexcal.model.robot import RobotModel
from flexcal.parallel import ThisProcess, open_workers
from flexcal.progress import Progress, silent
from flexcal.report.layout import Page, write_page
from flexcal.report.pages import PoseStudy, pose_page
from flexcal.units import MILLIMETRE

VERIFICATION = "verification"
"""Name of a plan of random poses."""
_FEW = 1000
"""Number of candidates for the comparison with a tracker."""


@dataclass(frozen=True, eq=False)
class RandomPoses:
    """Plan of random poses for a verification, with its file, random seed, sides of `approach_block` and provenance."""

    plan: PosePlan
    file: Path
    seed: int
    approaches: dict[str, dict[str, int]]
    record: RunRecord

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "plan": self.file,
            "poses": len(self.plan),
            "seed": self.seed,
            "approaches": self.approaches,
            **self.record.document(),
        }


@dataclass(frozen=True, eq=False, repr=False)
class DesignedPoses(PlottedResult):
    """Result of `design_poses`: a plan of calibration poses, with the criteria of the selection and the order of measurement.

    Attributes
    ----------
    model : RobotModel
        The robot that the plan is for.
    plan : PosePlan
        The poses in measuring order.
    design : PoseDesign
        The choice and its predicted uncertainty.
    curve : PoseCurve
        Predicted tool error by number of poses.
    way : MeasurementOrder
        The way through the poses.
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
    measure : str or None
        What is to measure, as requested; None for a tracker of points.
    with_tracker : float or None
        Predicted tool error, m, of as many poses with a tracker of points, where something else is to measure.
    tracker_zeros : mapping of float
        Predicted standard deviations of the joint zeros, rad or m, with that tracker.
    prior : FleetPrior or None
        Prior from other robots of the model, with which the robot will be calibrated.
    enough : EnoughPoses or None
        How many chosen poses with this prior reach what many random ones do without it.
    """

    plan: PosePlan
    design: PoseDesign
    curve: PoseCurve
    way: MeasurementOrder
    seed: int
    working: WorkingVolume | None = None
    pool: PosePool | None = None
    file: Path | None = None
    record: RunRecord = NOT_RECORDED
    measure: str | None = None
    with_tracker: float | None = None
    tracker_zeros: Mapping[str, float] = field(default_factory=dict)
    prior: FleetPrior | None = None
    enough: EnoughPoses | None = None

    @property
    def headline(self) -> str:
        """Number of poses and predicted tool error."""
        error = self.design.tool_error / MILLIMETRE
        return f"{len(self.plan)} poses, predicted tool error {error:.4f} mm from the noise of {self.instrument} alone"

    @property
    def instrument(self) -> str:
        """What is to measure, in words."""
        return {None: "a tracker", "pose": "a tracker of orientations too"}.get(
            self.measure, str(self.measure)
        )

    def summary(self) -> str:
        """Predicted tool error, rank, and the number of poses beyond which more only average noise."""
        seen = self.design.identifiability
        return "\n".join(
            [
                self.headline,
                f"{seen.rank} of {len(seen.names)} parameters are identifiable",
                self.number_sentence,
            ]
        )

    @property
    def number_sentence(self) -> str:
        """How many poses are enough."""
        if self.enough is None:
            return f"from {self.curve.enough()} poses on further ones only average noise"
        return enough_sentence(self.enough.document())

    def _page(self) -> Page:
        return plan_page(self.model, self.plan, self.document(), self.working)

    def document(self) -> dict[str, Any]:
        """JSON document; `chosen` are the poses' numbers in their file; poses left out there are listed with the reason.

        Moves in `blocked_moves` are pairs of poses of the plan, counted from 1.
        """
        design, curve = self.design, self.curve
        return (
            {"plan": self.file, "poses": len(self.plan)}
            | pool_block(design, self.pool, self.seed)
            | {
                "criterion": design.criterion.name,
                "candidates": design.looked_at,
                "tool_error_mm": design.tool_error / MILLIMETRE,
                "tool_error_p90_mm": design.tool_error_p90 / MILLIMETRE,
                "least_possible_mm": design.least_possible / MILLIMETRE,
                "measure": self.measure,
                "instrument": self.instrument,
                "unseen_mm": design.unseen / MILLIMETRE,
                "size": {
                    "std": design.size_std,
                    "sentence": f"all lengths of the robot will be known to ± {1e3 * design.size_std:.2g} ‰ (1σ) in common",
                },
                "with_tracker_mm": None if self.with_tracker is None else self.with_tracker / MILLIMETRE,
                "zeros": self._zeros(),
                "working": working_block(self.working),
                "criteria": design.criteria,
                "identifiability": identifiability_block(design.identifiability),
                "flanks": flank_block(design),
                "approaches": approach_block(self.model, self.plan),
                "moves_s": float(self.way.seconds.sum()),
                "blocked_moves": [[int(i) + 1, int(i) + 2] for i in np.flatnonzero(self.way.blocked)],
                "prior": self._prior(),
                "enough_poses": curve.enough() if self.enough is None else None,
                "curve": [
                    {
                        "poses": int(n),
                        "tool_error_mm": float(c) / MILLIMETRE,
                        "random_mm": float(r) / MILLIMETRE,
                    }
                    for n, c, r in zip(curve.counts, curve.chosen, curve.random, strict=True)
                ],
                **self.record.document(),
            }
        )

    def _prior(self) -> dict[str, Any] | None:
        if self.prior is None or self.enough is None:
            return None
        return {
            "file": self.prior.source,
            "robots": list(self.prior.robots),
            "parameters": len(self.prior.names),
            "enough": self.enough.document(),
            "sentence": self.number_sentence,
        }

    def _zeros(self) -> dict[str, dict[str, float | None]]:
        """Predicted standard deviations of the joint zeros, rad or m, with this instrument and with a tracker."""
        stds = zero_stds(self.design.base, self.design.selection.chosen)
        return {n: {"std": std, "with_tracker": self.tracker_zeros.get(n)} for n, std in stds.items()}


def enough_sentence(enough: Mapping[str, Any]) -> str:
    """How many chosen poses with a prior are enough; `enough` as in the document."""
    reached = f"{enough['alone']} random ones without it ({enough['rms_mm']:.2g} mm rms, from noise alone)"
    if enough["poses"] < enough["alone"]:
        return f"about {enough['poses']} chosen poses with this prior reach the accuracy of {reached}"
    return f"robots differ so much that no fewer chosen poses with this prior reach the accuracy of {reached}"


def pool_block(design: PoseDesign, pool: PosePool | None, seed: int) -> dict[str, Any]:
    """Selected poses of a pool, and those that were excluded; without a pool, the seed of the random poses."""
    if pool is None:
        return {"seed": seed}
    left_out = np.setdiff1d(pool.pose, design.candidates.pose)
    drawn = {} if pool.among is None else {"drawn": {"considered": len(pool), "among": pool.among}}
    return {
        "seed": None,
        "chosen": design.numbers,
        "flank_not_sure": np.setdiff1d(left_out, design.hidden),
        "not_seen": design.hidden,
        **drawn,
    }


def flank_block(design: PoseDesign) -> dict[str, dict[str, int]]:
    """Number of poses on each flank of every backlash."""
    return {
        joint: {"positive": int(np.sum(side > 0)), "negative": int(np.sum(side < 0))}
        for joint, side in zip(design.flank_joints, design.flank.T, strict=True)
    }


def with_approaches(checker: CollisionChecker, plan: PosePlan, seed: int) -> PosePlan:
    """Plan whose poses the joints come to from both sides, by the `seed`."""
    return replace(plan, approach=crossed_approaches(checker, plan, np.random.default_rng([seed, 11])))


def approach_block(model: RobotModel, plan: PosePlan) -> dict[str, dict[str, int]]:
    """Number of poses to which every joint comes in its positive and in its negative direction."""
    sides = np.zeros(plan.q.shape) if plan.approach is None else plan.approach
    return {
        joint.name: {"positive": int(np.sum(side > 0)), "negative": int(np.sum(side < 0))}
        for joint, side in zip(model.motor_joints, sides.T, strict=True)
    }


def working_block(working: WorkingVolume | None) -> dict[str, Any] | None:
    """Working volume for which the tool error counts; None for anywhere."""
    if working is None:
        return None
    return {"poses": len(working.q), "reached_share": working.reached, "box_m": working.box}


def design_poses(
    model: RobotModel, request: PoseRequest = DEFAULT_REQUEST, *, progress: Progress = silent
) -> DesignedPoses:
    """Choose calibration poses for the present robot model, in an order of short moves (Neubauer et al. 2015, section 5.2).

    Parameters
    ----------
    model : RobotModel
        Robot with what is known of it; its posterior and the tolerances are the prior.
    request : PoseRequest
        How many poses, by which criterion, from which candidates, for which working volume.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    DesignedPoses
        Its `plan`, predicted tool error, `summary()` and `report(path)`.

    Raises
    ------
    FlexcalError
        For an unknown criterion, fewer poses than the parameters need, too few candidates that pass the checks, candidates that press a
        backlash onto one flank only, and where more poses are needed for the desired error.

    Examples
    --------
    >>> from flexcal import PoseRequest, RobotModel, design_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> len(design_poses(model, PoseRequest(count=12, candidates=60)).plan)
    12
    """
    rng = np.random.default_rng([request.seed, 2])
    choice = CandidatePoses.best_of_blocks(model, request, rng, ThisProcess(), progress)
    return _designed(choice, request, rng, progress)


def _designed(
    choice: CandidatePoses, request: PoseRequest, rng: np.random.Generator, progress: Progress
) -> DesignedPoses:
    count, enough = request.count, None
    if request.prior is not None:
        enough = enough_with_prior(choice.candidates, np.random.default_rng([request.seed, 9]))
        count = min(count, enough.poses)
    if request.desired_error is not None:
        count = fewest_poses(choice.candidates, request.count, request.desired_error)
    design = choose_poses(choice.candidates, count, rng=rng, criterion=request.criterion, progress=progress)
    way = measurement_order(choice.checker, design.plan.q)
    design = design.in_order(way.order)
    curve = pose_curve(design, rng=np.random.default_rng([request.seed, 5]), progress=progress)
    plan = with_approaches(choice.checker, replace(design.plan, name="calibration"), request.seed)
    way = replace(way, blocked=blocked_ways(choice.checker, plan))
    designed = DesignedPoses(
        choice.checker.model, plan, design, curve, way, request.seed, choice.working, choice.pool
    )
    designed = replace(designed, prior=request.prior, enough=enough)
    if request.measure is None:
        return designed
    error, zeros = _with_tracker(choice, request, len(plan), progress)
    return replace(designed, measure=request.measure, with_tracker=error, tracker_zeros=zeros)


def _with_tracker(
    choice: CandidatePoses, request: PoseRequest, count: int, progress: Progress
) -> tuple[float, Mapping[str, float]]:
    """Predicted tool error, m, and standard deviations of joint zeros of `count` poses for a tracker of points, chosen one by one from
    few candidates.
    """
    rng = np.random.default_rng([request.seed, 7])
    few = replace(request, measure=None, candidates=max(_FEW, 2 * count), working=choice.working)
    candidates = CandidatePoses.of(choice.checker.model, few, rng, progress).candidates
    chosen = greedy(
        candidates.base.sensitivity, count, TraceOptimal(candidates.tool_error_weight, "c")
    ).chosen
    error = tool_error(candidates.base, candidates.tool_error_weight, chosen)
    return error, zero_stds(candidates.base, chosen)


def plan_calibration_poses(
    robot_file: Path,
    out: Path,
    request: PoseRequest,
    files: PoseRequestFiles,
    *,
    command: str = "",
    on: str | None = None,
    jobs: int = 1,
    progress: Progress = silent,
) -> DesignedPoses:
    """`design_poses` for the robot of a robot.yaml; the plan goes to `out`, its page beside it.

    Very many candidates are looked at by `jobs` processes, or `on` the Dask cluster of an address. Raises `FlexcalError` as `design_poses`
    and reading the `files` do.
    """
    model = RobotModel.from_yaml(robot_file)
    request = files.read(model, request)
    rng = np.random.default_rng([request.seed, 2])
    naming_pool = nullcontext() if files.pool is None else naming(files.pool)
    with naming_pool, open_workers(on, jobs) as workers:
        choice = CandidatePoses.best_of_blocks(model, request, rng, workers, progress)
    designed = _designed(choice, request, rng, progress)
    result = replace(designed, file=out, record=RunRecord(robot_provenance(model, files.paths), command))
    write_plan(out, result.plan)
    result.report(page_beside(out))
    return result


def plan_verification_poses(
    robot_file: Path, out: Path, count: int, *, payload: float | None = None, seed: int = 0, command: str = ""
) -> RandomPoses:
    """Draw `count` random verification poses over the whole workspace, and write the plan to `out` with its page beside it."""
    model = RobotModel.from_yaml(robot_file)
    setup = MeasuringSetup.declared(model, payload)
    checker = CollisionChecker(model)
    plan = random_poses(model, count, np.random.default_rng([seed, 4]), setup, checker=checker)
    plan = with_approaches(checker, replace(plan, name=VERIFICATION), seed)
    result = RandomPoses(
        plan, out, seed, approach_block(model, plan), RunRecord(robot_provenance(model), command)
    )
    write_plan(out, plan)
    write_page(page_beside(out), plan_page(model, plan, result.document(), None))
    return result


def plan_page(
    model: RobotModel, plan: PosePlan, document: dict[str, Any], working: WorkingVolume | None
) -> Page:
    """Report page of a plan of poses."""
    study = PoseStudy(model, plan.q, document)
    if working is not None:
        study = replace(study, working=working.points, box=working.box)
    return pose_page(study)
