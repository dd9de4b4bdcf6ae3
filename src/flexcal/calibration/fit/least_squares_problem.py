"""Least-squares problem of stage 2: geometry from measured points, with stiffness and inertia estimated jointly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from flexcal.calibration.error_model import Whitening
from flexcal.calibration.fit.elastic_prior import ElasticPrior
from flexcal.calibration.fit.fleet_prior import FleetPrior, prior_covariance
from flexcal.calibration.fit.predictions import Predictions
from flexcal.calibration.fit.terms import common_lengths
from flexcal.calibration.measurement import PredictedMeasurements, Readings
from flexcal.estimation import Estimate, Loss, Parameters, Problem, solve
from flexcal.progress import Progress

PlainLoss = Literal["squares", "huber", "cauchy"]
LossName = Literal["auto", "squares", "huber", "cauchy"]
_DAMPING = 1e-5
"""Damping of the first step: errors of a robot move its point nearly in proportion."""


@dataclass(frozen=True, eq=False)
class GeometryProblem:
    """Problem of fitting the geometric parameters `kept` to measured points on the backlash flanks `flank` (N, n).

    `prior` is what is known of stiffness and inertia beforehand, `fleet` what other robots of the model tell of the geometry; `whitening`
    weighs the readings.
    """

    predictions: Predictions
    kept: Parameters
    prior: ElasticPrior
    flank: np.ndarray
    whitening: Whitening
    fleet: FleetPrior | None = None

    @property
    def kept_covariance(self) -> np.ndarray:
        """Prior covariance (p, p) of the geometric parameters, infinite on the diagonal where there is none.

        Lengths with a tolerance are longer in common too, which other robots of the model would have told.
        """
        covariance = prior_covariance(self.kept, self.fleet)
        if self.fleet is None:
            start = self.predictions.start
            common = start.prior.scale * common_lengths(start, self.kept)
            covariance += np.outer(common, common)
        return covariance

    @property
    def prior_covariance(self) -> np.ndarray:
        """The same (p + e, p + e) with that of stiffness and inertia, in their coordinates, behind."""
        size = len(self.kept) + len(self.prior.parameters)
        covariance = np.zeros((size, size))
        covariance[: len(self.kept), : len(self.kept)] = self.kept_covariance
        covariance[len(self.kept) :, len(self.kept) :] = self.prior.covariance
        return covariance

    def predicted(self, values: Mapping[str, float], *, jacobians: bool = False) -> PredictedMeasurements:
        """Predicted measurements of the robot with the given named values, on the flanks of this fit."""
        return self.predictions.at(values, self.flank, jacobians=jacobians)

    def residual(self, at: PredictedMeasurements) -> np.ndarray:
        """Whitened residual (3 R,), measured minus predicted coordinates, Eq. (28)."""
        return self.whitening(at.residual)

    def columns(self, at: PredictedMeasurements, names: tuple[str, ...]) -> np.ndarray:
        """Whitened Jacobian of all coordinates (3 R, p) by some parameters, natural units."""
        return self.whitening(at.jacobian(names))

    def reestimated(self, *, loss: Loss | PlainLoss, tolerance: float, progress: Progress) -> Estimate:
        """Levenberg-Marquardt (29) on geometry, stiffness and inertia together; the latter keep their prior."""
        parameters = self.kept + self.prior.parameters

        def values(x: np.ndarray) -> dict[str, float]:
            return dict(zip(parameters.names, parameters.natural(x), strict=True))

        readings = Readings.of(self.predictions.poses)
        there = slice(None) if readings.present.all() else readings.present.ravel()

        def linearise(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            at = self.predicted(values(x), jacobians=True)
            columns = self.columns(at, parameters.names)[there]
            columns *= -parameters.natural_slope(x)
            return self.residual(at)[there], columns

        groups = np.repeat(readings.row, 3)[there]
        problem = Problem(parameters, linearise, None, self.prior_covariance, groups)
        return solve(problem, loss=loss, tolerance=tolerance, damping=_DAMPING, progress=progress)
