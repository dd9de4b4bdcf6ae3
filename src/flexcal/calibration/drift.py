"""Whether what was measured wandered between the first and the last point: a warming arm, an instrument that settles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.geometric_calibration import Calibration
from flexcal.calibration.geometry_fit import columns_of
from flexcal.calibration.prediction import predict
from flexcal.units import MILLIMETRE

_CHANCE = 0.0027
"""How often an arm that stays is said to drift: three standard deviations of a Gaussian."""


@dataclass(frozen=True, eq=False)
class Drift:
    """Way (3,) m that the points went in the first station's frame while they were measured, at an even pace; `covariance` (3, 3)."""

    travel: np.ndarray
    covariance: np.ndarray

    @property
    def distance(self) -> float:
        """How far they went (m)."""
        return float(np.linalg.norm(self.travel))

    @property
    def probability(self) -> float:
        """How often points that do not drift show so large a statistic: the p-value."""
        from scipy.stats import chi2

        statistic = self.travel @ np.linalg.solve(self.covariance, self.travel)
        return float(chi2.sf(statistic, len(self.travel)))

    @property
    def certain(self) -> bool:
        """Whether the p-value is below 0.27 %."""
        return self.probability < _CHANCE

    def document(self) -> dict[str, float | bool]:
        """The block `drift` of results.json."""
        return {"distance_mm": self.distance / MILLIMETRE, "certain": self.certain, "p": self.probability}

    @classmethod
    def of(cls, fit: Calibration) -> Drift:
        """From the residuals of a fit, by Rao's score test: what a drift of three coordinates more would estimate, to first order.

        The information on the drift is what the parameters of the fit cannot take up, S = Dᵀ (I - J Σ Jᵀ) D, with D its whitened
        columns and Σ the posterior; the chi-square that is left, where it exceeds one, widens it. Rows are in measuring order; outliers do
        not count.
        """
        poses, estimate = fit.poses, fit.estimate
        at = predict(fit.model, poses, flank=fit.flank, elastic=len(fit.prior.parameters) > 0, jacobians=True)
        slope = estimate.parameters.natural_slope(estimate.parameters.coordinates())
        weight = np.where(np.isin(np.arange(len(poses)), estimate.outliers), 0.0, 1.0)[:, None] / poses.sigma
        by_parameters = columns_of(at, estimate.parameters.names) * slope * weight.ravel()[:, None]
        share = np.linspace(-0.5, 0.5, len(poses))
        columns = np.kron(share[:, None], np.eye(3)) * weight.ravel()[:, None]
        raised = by_parameters.T @ columns
        covariance = np.linalg.inv(columns.T @ columns - raised.T @ estimate.covariance @ raised)
        score = columns.T @ (fit.residuals * weight).ravel()
        explained = score @ covariance @ score
        left = (estimate.chi2 - explained) / max(1, estimate.degrees_of_freedom - len(score))
        return cls(covariance @ score, covariance * max(1.0, left))
