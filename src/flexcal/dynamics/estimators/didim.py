"""Direct and inverse dynamic identification models (DIDIM): torques of a simulated closed loop (Gautier, Janot & Vandanjon 2013)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.dynamics.estimators.linear_least_squares import linear_fit
from flexcal.dynamics.estimators.recorded_rows import RecordedRows
from flexcal.dynamics.estimators.simulated_iteration import simulated_iteration
from flexcal.dynamics.estimators.wls import noise_levels
from flexcal.dynamics.regression import RegressionData
from flexcal.estimation import Estimate


def direct_and_inverse(data: RegressionData, recorded: RecordedRows) -> Estimate:
    """Estimate χ̂ minimising the weighted squares of measured less simulated torques, by Gauss-Newton with W_sim as derivative.

    The simulated torques are W_sim χ exactly, so a step is the weighted least squares of the measured torques on W_sim. Only the torques
    are measured: positions serve to say what was commanded. Weights, covariance and what is dropped are those of `linear_fit` with W_sim.
    Raises `FlexcalError` as `linear_fit` and `SimulatedExperiment` do, and where the iteration does not settle.
    """

    def step(robot: np.ndarray) -> Estimate:
        simulated = recorded.simulated(robot)
        estimate = linear_fit(simulated, noise_levels(simulated))
        return replace(estimate, message="Gauss-Newton on simulated torques")

    return simulated_iteration(data, step, "DIDIM")
