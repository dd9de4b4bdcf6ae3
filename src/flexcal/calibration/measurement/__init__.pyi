from .backlash_flanks import ambiguous_poses, require_both_flanks
from .prediction import (
    PredictedMeasurements,
    left_jacobian,
    predict_measurements,
    predicted_positions,
    require_points,
)
from .propagated_covariance import Propagation, covariance_root, moving_parameters, propagation
from .readings import METRES, RADIANS, Readings
from .registration import best_motion, register, require_orientations, rigid_motion, with_target_axes
from .station_start import turn_to_z

__all__ = [
    "METRES",
    "RADIANS",
    "PredictedMeasurements",
    "Propagation",
    "Readings",
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
    "require_orientations",
    "require_points",
    "rigid_motion",
    "turn_to_z",
    "with_target_axes",
]
