"""Poses among which a guided session chooses the next, and the working poses at which the tool error counts; computed once a session."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.poses import DEFAULT_SIGMA, PosePool, PoseSet
from flexcal.design.poses import measuring_noise, random_candidates, usable
from flexcal.design.scene import CollisionChecker, MeasuringSetup, visible
from flexcal.jobs.experiments import PoseRequest
from flexcal.model.kinematics import joint_ranges
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

CANDIDATES = 1500
_WORKING = 200


@dataclass(frozen=True, eq=False)
class PoseChoice:
    """Candidates `q` (M, n) with their numbers `pose` (M,), and `working` poses (W, n), at which the tool error counts: `anywhere` in the
    workspace, or in the working volume.

    All are within the joint limits and free of collision, and the instrument sees the target at the candidates. `checker` finds that of
    further poses; None where only the candidates may be measured.
    """

    q: np.ndarray
    pose: np.ndarray
    working: np.ndarray
    anywhere: bool
    setup: MeasuringSetup
    checker: CollisionChecker | None = None

    @classmethod
    def of(cls, model: RobotModel, request: PoseRequest, progress: Progress = silent) -> PoseChoice:
        """Candidates of a request, random ones or of its pool; raises `FlexcalError` where too few poses pass the checks."""
        checker, given = CollisionChecker(model), request.candidates
        setup = MeasuringSetup.declared(model, request.payload, request.measure)
        rng = np.random.default_rng([request.seed, 8])
        place = request.volume(checker)
        if isinstance(given, PosePool):
            pool = given.subset(visible(checker, given.q, setup))
        else:
            q = random_candidates(checker, given, rng, setup, preload=True, progress=progress)
            pool = PosePool(q, np.arange(1, len(q) + 1))
        anywhere = replace(setup, acceptance=None, measure=None)
        working = random_candidates(checker, _WORKING, rng, anywhere) if place is None else place.q[:_WORKING]
        free = None if isinstance(given, PosePool) else checker
        return cls(pool.q, pool.pose, working, place is None, setup, free)

    def neighbours(
        self, q: np.ndarray, count: int, share: float, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Poses (K, n) that can be measured, up to `count` near each of `q` (M, n), and the indices (K,) of these.

        Their distance is normal with a standard deviation of `share` of the range of every joint. There are none where only the candidates
        may be measured.
        """
        if self.checker is None:
            return q[:0], np.zeros(0, dtype=int)
        lower, upper = joint_ranges(self.checker.model)
        beside = np.repeat(np.arange(len(q)), count)
        near = q[beside] + share * (upper - lower) * rng.standard_normal((len(beside), q.shape[1]))
        near = np.clip(near, lower, upper)
        passed = usable(self.checker, near, self.setup, preload=True)
        return near[passed], beside[passed]

    def rows(self, model: RobotModel, q: np.ndarray, like: PoseSet | None) -> PoseSet:
        """Rows that would be measured at `q` (M, n), with target, station and payload as the last row of those measured.

        Where these say how noisy they are, so many times as noisy as expected of the instrument at these distances.
        """
        count = len(q)
        if like is not None:
            many = like.subset(np.full(count, len(like) - 1))
            sigma = np.full(count, DEFAULT_SIGMA)
            if like.sigma_given:
                there = measuring_noise(model, like.q, self.setup)
                ratio = float(np.median(np.sqrt((like.sigma**2).mean(axis=1)) / there))
                sigma = ratio * measuring_noise(model, q, self.setup)
            sigma = np.repeat(sigma[:, None], 3, axis=1)
            return replace(many, q=q, torque=None, sigma=sigma, pose=np.arange(1, count + 1))
        payload = self.setup.payload
        station = self.setup.station or model.stations.names[0]
        poses = PoseSet.unmeasured(q, model.point(self.setup.point).name, station)
        return poses if payload is None else replace(poses, payload=np.full(count, payload))
