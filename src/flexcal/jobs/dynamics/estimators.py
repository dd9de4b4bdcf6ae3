"""The estimators of dynamic parameters, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from flexcal.dynamics.estimators import (
    RecordedRows,
    direct_and_inverse,
    energy_least_squares,
    feasible_least_squares,
    huber_least_squares,
    instrumental_variables,
    kalman_filter,
    maximum_likelihood,
    ordinary_least_squares,
    perturbed_logs,
    power_least_squares,
    regressor_errors,
    total_least_squares,
    weighted_least_squares,
)
from flexcal.dynamics.regression import RegressionData
from flexcal.estimation import Estimate

EstimatorName = Literal["wls", "ols", "sdp", "irls", "iv", "didim", "energy", "power", "tls", "ml", "ekf"]

Estimator = Callable[[RegressionData, RecordedRows], Estimate]
"""Of the equations, and of the rows that they came from, for those that need to see them again."""

ESTIMATORS: dict[EstimatorName, Estimator] = {
    "wls": lambda data, _: weighted_least_squares(data),
    "ols": lambda data, _: ordinary_least_squares(data),
    "sdp": lambda data, _: feasible_least_squares(data),
    "irls": huber_least_squares,
    "iv": instrumental_variables,
    "didim": direct_and_inverse,
    "energy": lambda _, recorded: energy_least_squares(recorded),
    "power": lambda _, recorded: power_least_squares(recorded),
    "tls": lambda data, recorded: total_least_squares(
        data, regressor_errors(recorded, perturbed_logs(recorded))
    ),
    "ml": maximum_likelihood,
    "ekf": kalman_filter,
}
