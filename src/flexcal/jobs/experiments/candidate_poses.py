"""Candidate poses and working volume of a pose selection."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flexcal.calibration.fit import FleetPrior
from flexcal.data.poses import PosePool, read_pose_pool, read_working
from flexcal.design.poses import (
    BLOCK,
    BlockedCandidates,
    ChosenOfBlock,
    CriterionName,
    PoseCandidates,
    WorkingVolume,
    criterion_named,
    pose_candidates,
    working_box,
    working_points,
)
from flexcal.design.scene import CollisionChecker, MeasuringSetup
from flexcal.errors import InputError
from flexcal.jobs.fleet_prior import read_model_prior
from flexcal.jobs.logs import worker_robot
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.parallel import Workers
from flexcal.progress import Progress

MOST_GIVEN = 20_000
"""Largest number of poses of a file that are considered; of more, a random subset."""


@dataclass(frozen=True, eq=False)
class PoseRequest:
    """Requested poses of `design_poses` and `design_next_poses`.

    Parameters
    ----------
    count : int
        Number of poses; with `desired_error`, and of next poses, the largest.
    criterion : {"c", "A", "D", "E", "O1", "O2", "O3", "O4", "O5"}
        Criterion of optimality: c is the tool error predicted over the working volume, A the sum of the parameters' variances in units of
        their tolerances, D the volume of the confidence ellipsoid, E the least eigenvalue of the information, O1 to O5 the
        observability indices.
    candidates : int or PosePool
        So many random poses to choose from, or given ones.
    working : WorkingVolume or ndarray, optional
        Where the tool error counts: configurations, or smallest and largest x, y, z (2, 3), m, in the base frame; by default as robot.yaml
        declares, else anywhere.
    desired_error : float, optional
        Predicted tool error, m, at which no more poses are taken.
    payload : float, optional
        Mass, kg; by default that of the pool, else the declared one.
    seed : int
        Seed of the random poses.
    measure : str, optional
        What will measure: a name under `measurements:`, or "pose" for a tracker of orientations too; by default a tracker of points.
    prior : FleetPrior, optional
        Prior from other robots of the model, with which the robot will be calibrated: `count` is then the largest number, and poses end
        where they reach the predicted error of 40 random ones without it, or the desired one. What measures is a tracker of points.
    """

    count: int = 40
    criterion: CriterionName = "c"
    candidates: int | PosePool = 4000
    working: WorkingVolume | np.ndarray | None = None
    desired_error: float | None = None
    payload: float | None = None
    seed: int = 0
    measure: str | None = None
    prior: FleetPrior | None = None

    def volume(self, checker: CollisionChecker) -> WorkingVolume | None:
        """Working volume of the robot; None for anywhere. Raises `FlexcalError` for a box that it does not reach."""
        if isinstance(self.working, WorkingVolume):
            return self.working
        box, declared = self.working, checker.model.config.working_volume
        if box is None:
            if declared is None:
                return None
            box = np.array([declared.lower, declared.upper])
        return working_box(checker, box[0], box[1], np.random.default_rng([self.seed, 6]))


DEFAULT_REQUEST = PoseRequest()


@dataclass(frozen=True, eq=False)
class CandidatePoses:
    """Candidate poses: the `candidates`, the `pool` they come from, if any, and the working volume (None: anywhere)."""

    checker: CollisionChecker
    candidates: PoseCandidates
    pool: PosePool | None
    working: WorkingVolume | None

    @classmethod
    def of(
        cls,
        model: RobotModel,
        request: PoseRequest,
        rng: np.random.Generator,
        progress: Progress,
    ) -> CandidatePoses:
        """Candidates, at least as many as requested; raises `FlexcalError` as `pose_candidates` and `working_box` do."""
        return cls._among(model, request, request.candidates, rng, progress)

    @classmethod
    def best_of_blocks(
        cls,
        model: RobotModel,
        request: PoseRequest,
        rng: np.random.Generator,
        workers: Workers,
        progress: Progress,
    ) -> CandidatePoses:
        """As `of`; of very many random ones, what `BlockedCandidates` keeps of their blocks, each looked at by one of the `workers`.

        The result does not depend on the workers. Raises `FlexcalError` as `of` and `exchange` do, and where a worker fails.
        """
        total = request.candidates
        if isinstance(total, PosePool) or total <= BLOCK:
            return cls.of(model, request, rng, progress)
        whole = cls._among(worker_robot(model, workers), request, BLOCK, rng, progress)
        criterion = criterion_named(request.criterion, whole.candidates.tool_error_weight)
        blocked = BlockedCandidates.of(
            whole.candidates, whole.checker, criterion, request.count, total, request.seed, BLOCK
        )
        chosen = [blocked.chosen_of_first()]
        numbers = blocked.blocks
        for one in workers.values(_chosen_of_block, numbers, blocked.without_first()):
            chosen.append(one)
            progress("candidates", len(chosen) / (len(numbers) + 1))
        return replace(whole, candidates=blocked.united(chosen))

    @classmethod
    def _among(
        cls,
        model: RobotModel,
        request: PoseRequest,
        given: int | PosePool,
        rng: np.random.Generator,
        progress: Progress,
    ) -> CandidatePoses:
        checker = CollisionChecker(model)
        place = request.volume(checker)
        candidates = pose_candidates(
            model,
            rng=rng,
            candidates=given,
            least=request.count,
            setup=MeasuringSetup.declared(model, request.payload, request.measure),
            working=None if place is None else place.q,
            checker=checker,
            fleet=request.prior,
            progress=progress,
        )
        return cls(checker, candidates, given if isinstance(given, PosePool) else None, place)


def _chosen_of_block(number: int, blocked: BlockedCandidates) -> ChosenOfBlock:
    return blocked.chosen(number)


@dataclass(frozen=True)
class PoseRequestFiles:
    """Files of a `PoseRequest`: a `pool` of poses to choose from, the `working` volume, a box "x:X,y:Y,z:Z" (m, base frame) or a file of
    points or poses, and the `prior` from other robots, as `flexcal fleet --prior` writes it.
    """

    pool: Path | None = None
    working: str | None = None
    prior: Path | None = None

    @property
    def paths(self) -> tuple[Path, ...]:
        """Options that are paths of files."""
        return tuple(file for file in (self.pool, working_file(self.working), self.prior) if file is not None)

    def read(self, model: RobotModel, request: PoseRequest) -> PoseRequest:
        """Request with the contents of the files; raises `FlexcalError` as `read_pose_pool`, `read_working`, `working_box` and
        `read_model_prior` do, and for a prior that tells no geometry.
        """
        if self.prior is not None:
            geometry = read_model_prior(self.prior, model).geometry
            if geometry is None:
                raise InputError(
                    "E-PRIOR-018",
                    f"{self.prior} tells nothing of the geometry, for which poses are chosen; choose them without it, or make a prior from "
                    "calibrated robots.",
                )
            request = replace(request, prior=geometry)
        if self.working is not None:
            place = working_volume(CollisionChecker(model), self.working, request.seed)
            request = replace(request, working=place)
        if self.pool is not None:
            request = replace(request, candidates=read_pose_pool(self.pool, model).drawn(MOST_GIVEN))
        return request


def working_file(given: str | None) -> Path | None:
    """File that defines the working volume; None if a box or robot.yaml does."""
    return None if given is None or ":" in given else Path(given)


def working_volume(checker: CollisionChecker, given: str, seed: int) -> WorkingVolume:
    """Working volume of the robot: a box "x:X,y:Y,z:Z" (m, base frame), else a file for `read_working`.

    Raises `FlexcalError` for a box that is none, and what the robot does not reach.
    """
    model, rng = checker.model, np.random.default_rng([seed, 6])
    file = working_file(given)
    if file is None:
        corners = box_corners(given)
        return working_box(checker, corners[0], corners[1], rng)
    q, points = read_working(file, model)
    if points is not None:
        return working_points(checker, points, rng)
    assert q is not None
    return WorkingVolume(q, point_kinematics(model, q, jacobians=False).position)


def box_corners(text: str) -> np.ndarray:
    """Corners (2, 3) of "x:X,y:Y,z:Z"; raises `InputError` for other text."""
    try:
        ranges = [[float(end) for end in part.split(":")] for part in text.split(",")]
        corners = np.array(ranges).T
        if corners.shape != (2, 3) or not np.isfinite(corners).all():
            raise ValueError
    except ValueError:
        raise InputError(
            "E-RUN-037",
            f"--working {text} is no box; write smallest and largest x, y and z in m like 0.4:0.9,-0.3:0.3,0.2:0.8, or name a file.",
        ) from None
    return corners
