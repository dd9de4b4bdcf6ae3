from .experiment_effect import ExperimentEffect, experiment_effects
from .model_error import ModelError, Tolerances
from .parameter_names import hardening_name, held_inertia_name, slip_share_name
from .parameters import SLIP_SHARE, check_responses, check_sensors, stiffness_parameters
from .prediction import PredictedMeasurements, ResponseModel
from .residual import CLUSTER_LINES, ResponseResidual, element_scale
from .weighting import CovarianceWeighting, ResonanceWeighting, UniformWeighting, Weighting

__all__ = [
    "CLUSTER_LINES",
    "SLIP_SHARE",
    "CovarianceWeighting",
    "ExperimentEffect",
    "ModelError",
    "PredictedMeasurements",
    "ResonanceWeighting",
    "ResponseModel",
    "ResponseResidual",
    "Tolerances",
    "UniformWeighting",
    "Weighting",
    "check_responses",
    "check_sensors",
    "element_scale",
    "experiment_effects",
    "hardening_name",
    "held_inertia_name",
    "slip_share_name",
    "stiffness_parameters",
]
