"""Ordinary least squares: equal weights of all equations (Eq. 2.31 of Eq. 2.26)."""

from __future__ import annotations

from flexcal.dynamics.estimators.linear_least_squares import linear_fit
from flexcal.dynamics.regression import RegressionData
from flexcal.estimation import Estimate


def ordinary_least_squares(data: RegressionData) -> Estimate:
    """Estimate χ̂ with one σ̂ for all joints and experiments; raises `FlexcalError` as `linear_fit` does."""
    return linear_fit(data, [1.0] * len(data.subsystems))
