"""Iteratively reweighted least squares with Huber's loss, robust to outliers in single rows (Huber 1964)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.dynamics.estimators.linear_least_squares import linear_fit
from flexcal.dynamics.estimators.recorded_rows import RecordedRows
from flexcal.dynamics.estimators.wls import weighted_least_squares
from flexcal.dynamics.regression import RegressionData
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate

_TUNING = 1.345
"""Standard deviations up to which a row has full weight: 95 % efficiency relative to least squares for normal errors (Huber 1981)."""
_NORMAL = 1.4826
"""Ratio of σ to the median absolute value of normal errors."""
_SETTLED = 1e-2
"""Largest step of a parameter, in its standard deviations, at which the iteration has converged."""
_ITERATIONS = 50
_ROUNDING = 10.0
"""Ratio to the least noise level up to which residuals are those of rounding."""


def huber_least_squares(data: RegressionData, recorded: RecordedRows) -> Estimate:
    """Estimate χ̂ minimising Huber's loss of every row and joint, starting from `weighted_least_squares` of the same equations.

    Weights are min(1, 1.345 σ̂ / |ρ|), with σ̂ = 1.4826 median |ρ| of each joint and experiment, both renewed at every step: two passes
    over `recorded`. The covariance is that of `linear_fit` for the weighted rows, times (mean weight / share of rows of full weight)²:
    rows beyond the bend of the loss do not answer to the parameters (Huber 1981, section 7.6), for which one number serves all joints.
    Raises `FlexcalError` as `weighted_least_squares` does, and where the steps do not settle.
    """
    estimate = weighted_least_squares(data)
    for iteration in range(1, _ITERATIONS + 1):
        before = estimate.parameters.coordinates()
        residuals = recorded.residuals(before)
        noise = _robust_noise(data, residuals)
        weights = _weights(residuals, noise)
        estimate = linear_fit(recorded.weighted(weights), noise)
        seen = np.array(estimate.identifiable)
        step = np.abs(estimate.parameters.coordinates() - before)[seen]
        settled = np.all(step <= _SETTLED * np.sqrt(np.diag(estimate.covariance))[seen])
        if settled or _is_rounding(data, noise):
            every = np.concatenate([own[np.isfinite(own)] for own in weights])
            bend = float(np.mean(every) / np.mean(every == 1.0))
            return replace(
                estimate,
                covariance=bend**2 * estimate.covariance,
                message=f"Huber's loss; {np.mean(every < 0.5):.2%} of the rows have a weight below 0.5",
                iterations=iteration,
            )
    raise FlexcalError(
        "E-DYN-005",
        f"the weights of the rows do not converge in {_ITERATIONS} iterations; use --estimator wls.",
    )


def _robust_noise(data: RegressionData, residuals: Sequence[np.ndarray]) -> list[float]:
    """σ̂ of each subsystem, N m, by the median."""
    return [
        s.floored(_NORMAL * float(np.nanmedian(np.abs(residuals[s.experiment][s.equation]))))
        for s in data.subsystems
    ]


def _is_rounding(data: RegressionData, noise: Sequence[float]) -> bool:
    """Whether equations without noise leave rounding alone, among which weights never settle."""
    return all(n <= _ROUNDING * s.floored(0.0) for s, n in zip(data.subsystems, noise, strict=True))


def _weights(residuals: Sequence[np.ndarray], noise: Sequence[float]) -> list[np.ndarray]:
    scales = np.reshape(noise, (len(residuals), -1, 1))
    return [_TUNING / np.maximum(np.abs(r) / s, _TUNING) for r, s in zip(residuals, scales, strict=True)]
