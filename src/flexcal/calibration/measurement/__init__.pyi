from .backlash_flanks import ambiguous_poses, require_both_flanks
from .prediction import PredictedMeasurements, predict_measurements, predicted_positions, require_points
from .propagated_covariance import Propagation, covariance_root, moving_parameters, propagation
from .registration import register, rigid_motion

__all__ = [
    "PredictedMeasurements",
    "Propagation",
    "ambiguous_poses",
    "covariance_root",
    "moving_parameters",
    "predict_measurements",
    "predicted_positions",
    "propagation",
    "register",
    "require_both_flanks",
    "require_points",
    "rigid_motion",
]
