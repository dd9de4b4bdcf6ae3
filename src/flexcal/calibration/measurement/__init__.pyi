from .backlash_flanks import ambiguous_poses, require_both_flanks
from .prediction import (
    PredictedMeasurements,
    left_jacobian,
    predict_measurements,
    predicted_positions,
    require_points,
)
from .propagated_covariance import Propagation, covariance_root, moving_parameters, propagation
from .registration import best_motion, register, rigid_motion

__all__ = [
    "PredictedMeasurements",
    "Propagation",
    "ambiguous_poses",
    "best_motion",
    "covariance_root",
    "left_jacobian",
    "moving_parameters",
    "predict_measurements",
    "predicted_positions",
    "propagation",
    "register",
    "require_both_flanks",
    "require_points",
    "rigid_motion",
]
