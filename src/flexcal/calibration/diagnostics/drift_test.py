"""Score test for a drift of robot or instrument during the measurement."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from flexcal.calibration.diagnostics.further_columns import columns_of_drift, ramp
from flexcal.calibration.fit import GeometricFit
from flexcal.estimation import f_tail
from flexcal.units import MILLIMETRE

_CHANCE = 0.0027
"""Significance level of a drift: three standard deviations of a Gaussian."""


@dataclass(frozen=True, eq=False)
class Drift:
    """Drift (3,) m of the points in the first station's frame during the measurement, at constant rate; `covariance` (3, 3).

    `freedom` are the degrees of freedom of the scatter in that covariance. `left` (3,) m is the part of it in the residuals, whose straight
    line has it from the first row to the last: what the fit did not take up by its parameters.
    """

    travel: np.ndarray
    covariance: np.ndarray
    freedom: int
    left: np.ndarray

    @property
    def distance(self) -> float:
        """Length of the drift, m."""
        return float(np.linalg.norm(self.travel))

    @property
    def residual(self) -> float:
        """Length of what the residuals drift by, m."""
        return float(np.linalg.norm(self.left))

    @property
    def probability(self) -> float:
        """p-value of the F test for no drift."""
        size = len(self.travel)
        statistic = self.travel @ np.linalg.solve(self.covariance, self.travel) / size
        return f_tail(size, max(self.freedom, 1), float(statistic))

    @property
    def certain(self) -> bool:
        """Whether the drift is significant: p below 0.27 %."""
        return self.probability < _CHANCE

    def document(self) -> dict[str, float | bool]:
        """Block of a JSON document."""
        return {
            "distance_mm": self.distance / MILLIMETRE,
            "residual_mm": self.residual / MILLIMETRE,
            "p": self.probability,
            "certain": self.certain,
        }

    @classmethod
    @lru_cache(maxsize=1)
    def of(cls, fit: GeometricFit) -> Drift:
        """Score test (Rao) on the residuals of a fit: first-order estimate of a drift with three further coordinates.

        The covariance of the errors is that of the fit without what stretches of the measuring order share, scaled by the chi-square
        that is left. Rows are in measuring order; outliers do not count, nor do points in sockets, distances and touches, which take a
        drift for another place of fixture, wire or face: at least one point must be of an instrument.
        """
        poses = fit.poses
        share = ramp(fit)
        products = fit.linear.products_in_time(fit.scatter, columns_of_drift(fit))
        covariance = np.linalg.inv(products[:-1, :-1])
        travel = covariance @ products[:-1, -1]
        freedom = fit.linear.freedom - len(travel)
        left = float(products[-1, -1] - products[:-1, -1] @ travel)
        seen = np.flatnonzero(poses.located & ~np.isin(np.arange(len(poses)), fit.estimate.outliers))
        centred = share[seen] - share[seen].mean()
        slope = centred @ fit.residuals[seen] / float(centred @ centred)
        return cls(travel, covariance * max(1.0, left / max(freedom, 1)), freedom, slope)
