"""The least-squares problem of stage 2: geometry from measured points, with stiffness and inertia estimated again beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from flexcal.calibration.elastic_prior import ElasticPrior
from flexcal.calibration.prediction import Prediction, predict
from flexcal.data import PoseSet
from flexcal.estimation import Estimate, Loss, Parameters, Problem, solve
from flexcal.model import RobotModel

LossName = Literal["squares", "huber", "cauchy"]


@dataclass(frozen=True, eq=False)
class GeometryFit:
    """Geometric parameters `kept` of the robot `start` to be fitted to `poses` that rest on `flank` (N, n).

    `prior` is what is known of stiffness and inertia beforehand; `elastic` says whether the arm deflects at all.
    """

    start: RobotModel
    poses: PoseSet
    kept: Parameters
    prior: ElasticPrior
    flank: np.ndarray
    elastic: bool

    @property
    def sigma(self) -> np.ndarray:
        """1σ of every measured coordinate (3 N,), m."""
        return self.poses.sigma.ravel()

    def predicted(self, values: Mapping[str, float], *, jacobians: bool = False) -> Prediction:
        """Where the robot with some named values should be seen, on the flanks of this fit."""
        robot = self.start.with_values(values)
        return predict(robot, self.poses, flank=self.flank, elastic=self.elastic, jacobians=jacobians)

    def residual(self, at: Prediction) -> np.ndarray:
        """Measured minus predicted coordinates (3 N,), m: Eq. (28)."""
        return (self.poses.position - at.position).ravel()

    def reestimated(
        self, *, loss: Loss | LossName, progress: Callable[[int, float], None] | None
    ) -> Estimate:
        """Levenberg-Marquardt (29) on geometry, stiffness and inertia together; the latter keep their prior."""
        parameters, sigma = self.kept + self.prior.parameters, self.sigma

        def values(x: np.ndarray) -> dict[str, float]:
            return dict(zip(parameters.names, parameters.natural(x), strict=True))

        def linearise(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            at = self.predicted(values(x), jacobians=True)
            columns = columns_of(at, parameters.names) * parameters.natural_slope(x)
            return self.residual(at) / sigma, -columns / sigma[:, None]

        def residual(x: np.ndarray) -> np.ndarray:
            return self.residual(self.predicted(values(x))) / sigma

        covariance = np.diag(np.full(len(parameters), np.inf))
        covariance[len(self.kept) :, len(self.kept) :] = self.prior.covariance
        groups = np.repeat(np.arange(len(self.poses)), 3)
        problem = Problem(parameters, linearise, residual, covariance, groups)
        return solve(problem, loss=loss, progress=progress)


def columns_of(at: Prediction, names: tuple[str, ...]) -> np.ndarray:
    """Jacobian of all coordinates (3 N, p) by some parameters, natural units."""
    return at.jacobian(names).reshape(-1, len(names))
