"""Weighted least squares: the equations of each joint (or motor alone) and experiment by their own noise (Eqs. 2.29-2.31)."""

from __future__ import annotations

import numpy as np

from flexcal.dynamics.linear_fit import linear_fit
from flexcal.dynamics.regression import RegressionData
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate


def weighted_least_squares(data: RegressionData) -> Estimate:
    """χ̂ with the equations of each subsystem divided by its `noise_levels`; raises `FlexcalError` as that and `linear_fit` do."""
    return linear_fit(data, noise_levels(data))


def noise_levels(data: RegressionData) -> list[float]:
    """σ̂ of each subsystem, N m, from its own fit, by its rows less its rank (Eq. 2.28).

    A subsystem that its own parameters fit exactly counts as if it had 1e-12 of its torque as noise. Raises `FlexcalError` where a
    subsystem has no more rows than it determines parameters.
    """
    noise = []
    for s, (sigma, rank) in zip(data.subsystems, data.noise(), strict=True):
        if np.isnan(sigma):
            label = data.observation.labels[s.equation]
            raise FlexcalError(
                f"{s.triangle.rows} equations of {label} in experiment {s.experiment + 1} do not determine its noise beside "
                f"{rank} parameters; "
                "record for longer, or decimate less."
            )
        noise.append(s.floored(sigma))
    return noise
