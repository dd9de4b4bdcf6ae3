"""Candidate poses and working volume of a pose selection."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal.data.poses import PosePool, read_pose_pool, read_working
from flexcal.design.poses import (
    CriterionName,
    PoseCandidates,
    WorkingVolume,
    pose_candidates,
    working_box,
    working_points,
)
from flexcal.design.scene import CollisionChecker, MeasuringSetup
from flexcal.errors import InputError, naming
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress

MOST_GIVEN = 20_000
"""Poses of a file that are considered; more are drawn from."""


@dataclass(frozen=True)
class PoseRequest:
    """Which poses `plan_calibration_poses` and `plan_next_poses` choose, at most `count`.

    `candidates`: so many random poses to choose from, or a file of poses. `working`: where the tool error counts, as in `working_volume`.
    `wanted`: the predicted tool error, m, at which no more poses are taken, None for no such end. `payload` in kg, None for the file's,
    else the declared one.
    """

    count: int
    criterion: CriterionName = "c"
    candidates: int | Path = 4000
    working: str | None = None
    wanted: float | None = None
    payload: float | None = None
    seed: int = 0


@dataclass(frozen=True, eq=False)
class CandidatePoses:
    """The `candidates`, the given `pool` that they come from, if any, where the robot will work (None: anywhere), and the `files` of
    both."""

    checker: CollisionChecker
    candidates: PoseCandidates
    pool: PosePool | None
    working: WorkingVolume | None
    files: tuple[Path, ...]

    @classmethod
    def of(
        cls,
        model: RobotModel,
        request: PoseRequest,
        rng: np.random.Generator,
        progress: Progress,
    ) -> CandidatePoses:
        """As many as are to be chosen or more; raises `FlexcalError` as `pose_candidates`, `read_pose_pool`, `working_volume` do."""
        checker, candidates = CollisionChecker(model), request.candidates
        place = working_volume(checker, request.working, request.seed)
        given = (
            read_pose_pool(candidates, model).drawn(MOST_GIVEN)
            if isinstance(candidates, Path)
            else candidates
        )
        with naming(candidates) if isinstance(candidates, Path) else nullcontext():
            pose_pool = pose_candidates(
                model,
                rng=rng,
                candidates=given,
                least=request.count,
                setup=MeasuringSetup.declared(model, request.payload),
                working=None if place is None else place.q,
                checker=checker,
                progress=progress,
            )
        files = [candidates] if isinstance(candidates, Path) else []
        if (file := working_file(request.working)) is not None:
            files.append(file)
        return cls(checker, pose_pool, given if isinstance(given, PosePool) else None, place, tuple(files))


def working_file(given: str | None) -> Path | None:
    """The file that says where the robot will work; None where a box does, or robot.yaml."""
    return None if given is None or ":" in given else Path(given)


def working_volume(checker: CollisionChecker, given: str | None, seed: int) -> WorkingVolume | None:
    """Where the robot will work: a box "x:X,y:Y,z:Z" (m, base frame), else a file for `read_working`, else what robot.yaml declares.

    None where nothing does. Raises `FlexcalError` for a box that is none, and what the robot does not reach.
    """
    model, rng = checker.model, np.random.default_rng([seed, 6])
    declared = model.config.working_volume
    if given is None:
        if declared is None:
            return None
        return working_box(checker, np.array(declared.lower), np.array(declared.upper), rng)
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
