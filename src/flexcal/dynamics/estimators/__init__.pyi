from .column_noise import perturbed_logs, regressor_errors
from .didim import direct_and_inverse
from .ekf import kalman_filter
from .energy_model import energy_least_squares
from .estimator import (
    DIDIM,
    EKF,
    ESTIMATORS,
    IRLS,
    IV,
    ML,
    OLS,
    SDP,
    TLS,
    WLS,
    EnergyModel,
    Estimator,
    EstimatorName,
    PowerModel,
)
from .feasible import feasible_least_squares
from .idim_iv import instrumental_variables
from .irls import huber_least_squares
from .iv_estimate import InstrumentalFit, instrumental_fit
from .linear_least_squares import Unknowns, weighted_system
from .ols import ordinary_least_squares
from .periodic_likelihood import maximum_likelihood
from .physical_constraints import extended
from .power_model import power_least_squares
from .recorded_rows import RecordedRows
from .tls import total_least_squares
from .wls import noise_levels, weighted_least_squares

__all__ = [
    "DIDIM",
    "EKF",
    "ESTIMATORS",
    "IRLS",
    "IV",
    "ML",
    "OLS",
    "SDP",
    "TLS",
    "WLS",
    "EnergyModel",
    "Estimator",
    "EstimatorName",
    "InstrumentalFit",
    "PowerModel",
    "RecordedRows",
    "Unknowns",
    "direct_and_inverse",
    "energy_least_squares",
    "extended",
    "feasible_least_squares",
    "huber_least_squares",
    "instrumental_fit",
    "instrumental_variables",
    "kalman_filter",
    "maximum_likelihood",
    "noise_levels",
    "ordinary_least_squares",
    "perturbed_logs",
    "power_least_squares",
    "regressor_errors",
    "total_least_squares",
    "weighted_least_squares",
    "weighted_system",
]
