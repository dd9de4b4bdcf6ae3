"""Instrumental variables from the simulated closed loop (IDIM-IV), unbiased by noisy velocities and accelerations (Janot et al. 2014)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.dynamics.estimators.iv_estimate import instrumental_fit
from flexcal.dynamics.estimators.recorded_rows import RecordedRows
from flexcal.dynamics.estimators.simulated_iteration import simulated_iteration
from flexcal.dynamics.estimators.wls import noise_levels, weighted_least_squares
from flexcal.dynamics.regression import RegressionData
from flexcal.estimation import Estimate, Parameter, Parameters


def instrumental_variables(data: RegressionData, recorded: RecordedRows) -> Estimate:
    """Estimate χ̂ of ZᵀW χ̂ = ZᵀY, Z the observation matrix of the closed loop simulated with χ̂, through the filters of W and Y.

    The rows of a joint and experiment are divided by `noise_levels` of theirs. Which parameters the data tell, and what the others
    absorb, is as in `weighted_least_squares`; the covariance is (ZᵀW)⁻¹ M (WᵀZ)⁻¹ with M that of `score_covariance`. Raises
    `FlexcalError` as `weighted_least_squares`, `SimulatedExperiment` and `instrumental_fit` do, and where the
    iteration does not settle.
    """
    linear, noise = weighted_least_squares(data), noise_levels(data)
    kept = [number for number, seen in enumerate(linear.identifiable) if seen]
    start = linear.parameters.coordinates()

    def step(robot: np.ndarray) -> Estimate:
        batches = [system.batches for system in recorded.instrumented(robot)]
        fit = instrumental_fit(batches, data.observation.column_indices, noise, start, kept)
        covariance = np.zeros_like(linear.covariance)
        covariance[np.ix_(kept, kept)] = fit.covariance.covariance
        return replace(
            linear,
            parameters=Parameters(
                Parameter(item.name, item.unit, float(value))
                for item, value in zip(linear.parameters, fit.values, strict=True)
            ),
            covariance=covariance,
            cost=fit.cost,
            chi2=fit.cost,
            message=f"instrumental variables; their weakest correlation with the recorded motion is {fit.weakest:.3g}",
            covariance_freedom=fit.covariance.freedom,
        )

    return simulated_iteration(data, step, "IDIM-IV")
