from .backlash_flanks import OneFlank, ambiguous_poses, require_both_flanks
from .base_frame import random_poses, seen_from_base, with_stations_at_base
from .hand_eye import with_camera_places
from .joint_zeros import register_with_zeros, with_places_of
from .prediction import (
    PredictedMeasurements,
    predict_measurements,
    predicted_positions,
    require_points,
)
from .propagated_covariance import (
    Propagation,
    covariance_root,
    lag_rms,
    moving_parameters,
    propagation,
    unknown_sides,
)
from .readings import METRES, OF_INSTRUMENTS, RADIANS, ROBOT, Readings, kind_names, stated_sigma
from .registration import register, require_orientations, with_target_axes
from .unknown_load import sag_columns, with_load_at

__all__ = [
    "METRES",
    "OF_INSTRUMENTS",
    "RADIANS",
    "ROBOT",
    "OneFlank",
    "PredictedMeasurements",
    "Propagation",
    "Readings",
    "ambiguous_poses",
    "covariance_root",
    "kind_names",
    "lag_rms",
    "moving_parameters",
    "predict_measurements",
    "predicted_positions",
    "propagation",
    "random_poses",
    "register",
    "register_with_zeros",
    "require_both_flanks",
    "require_orientations",
    "require_points",
    "sag_columns",
    "seen_from_base",
    "stated_sigma",
    "unknown_sides",
    "with_camera_places",
    "with_load_at",
    "with_places_of",
    "with_stations_at_base",
    "with_target_axes",
]
