"""Number of poses that with a prior from other robots reach what many do without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from flexcal.calibration.fit import OF_THE_CELL, FleetPrior, GeometricFit, plausible_size
from flexcal.calibration.measurement import predict_measurements, random_poses
from flexcal.estimation import Parameters
from flexcal.units import MILLIMETRE

_ELSEWHERE = 100
"""Poses at which errors are predicted."""
_FEWEST = 3
"""Poses that tell the place of an instrument and a target, nine numbers."""
_COMMON = 0.5
"""Largest error common to several poses, over their own, that is taken for one of each: more poses average it less."""


@dataclass(frozen=True)
class EnoughPoses:
    """The least number of `poses` that with the prior reach the predicted `error`, m (root mean square), of `alone` poses without it."""

    ALONE: ClassVar[int] = 40
    """Poses without a prior, with which those with it are compared."""
    SETS: ClassVar[int] = 6
    """Sets of random poses over which errors are averaged."""

    poses: int
    alone: int
    error: float

    def document(self) -> dict[str, Any]:
        """Entry of results.json."""
        return {"poses": self.poses, "alone": self.alone, "rms_mm": self.error / MILLIMETRE}

    @classmethod
    def least(cls, goal: float, alone: int, error: Callable[[int], float]) -> EnoughPoses:
        """Least number of poses with an `error` (m) of at most the `goal`, that of `alone` without a prior; as many if none does."""
        enough = next((k for k in range(_FEWEST, alone) if error(k) <= goal), alone)
        return cls(enough, alone, goal)

    @classmethod
    def of(cls, fit: GeometricFit) -> EnoughPoses | None:
        """Predicted with the covariance of the parameters after measuring random poses in the joint ranges of those of the fit, at other
        such poses, with its scatter; averaged over six sets of poses.

        None without a prior from other robots, and where poses do not tell alike: with more than one point, station or measurement a pose,
        angles, fixtures, springs, and errors that are common to several poses, which more of them do not average.
        """
        fleet, scatter, poses = fit.fleet, fit.scatter, fit.poses
        many = max(len(set(poses.target.tolist())), len(set(poses.station.tolist()))) > 1
        apart = len(set(poses.pose.tolist())) == len(poses)
        shared = scatter.transmission > 0 or len(fit.prior.parameters) > 0
        if fleet is None or not fleet.names or many or not apart or shared:
            return None
        if not poses.located.all() or poses.angled.any():
            return None
        blocks = scatter.independent(fit.linear.readings, fit.linear.turns)
        noise = float(np.sqrt(np.trace(blocks, axis1=1, axis2=2).mean() / 3))
        if scatter.model > _COMMON * noise:
            return None
        noise = float(np.hypot(noise, scatter.model))
        parameters = _free(fit, fleet)
        limits = np.stack([poses.q.min(axis=0), poses.q.max(axis=0)])
        drawn = random_poses(fit.model, limits, [str(poses.target[0])], cls.SETS * cls.ALONE + _ELSEWHERE)
        columns = predict_measurements(fit.model, drawn, elastic=False, jacobians=True).jacobian(
            parameters.names
        )
        sizes = np.array([plausible_size(fit.model, name) for name in parameters.names])
        columns = columns * sizes
        sets = columns[_ELSEWHERE:].reshape(cls.SETS, cls.ALONE, 3, -1) / noise
        elsewhere = np.einsum("nip,niq->pq", columns[:_ELSEWHERE], columns[:_ELSEWHERE]) / _ELSEWHERE
        before = np.diag((sizes / np.minimum(parameters.prior_std(), sizes)) ** 2)
        own = fleet.among(parameters.names)
        rows = [parameters.index(name) for name in own.names]
        known = before.copy()
        known[np.ix_(rows, rows)] = np.linalg.inv(own.covariance / np.outer(sizes[rows], sizes[rows]))
        before[rows, rows] = 1.0

        def error(count: int, prior: np.ndarray) -> float:
            informations = np.einsum("skip,skiq->spq", sets[:, :count], sets[:, :count]) + prior
            variances = np.trace(np.linalg.solve(informations, elsewhere[None]), axis1=1, axis2=2)
            return float(np.sqrt(variances).mean())

        return cls.least(error(cls.ALONE, before), cls.ALONE, lambda count: error(count, known))


def _free(fit: GeometricFit, fleet: FleetPrior) -> Parameters:
    """Parameters of the prior, and the place of instrument and target: further errors of joints look like these."""
    own = set(fleet.names)
    return Parameters(p for p in fit.estimate.parameters if p.name in own or p.name.startswith(OF_THE_CELL))
