from .arm_poses import ArmPoses, arms_at, evenly
from .best_fit_registration import best_placement, can_register, can_register_with_points, rigid_placement
from .error_scale_test import ErrorScale, error_scale, prediction_document
from .errors_by_model import CALIBRATED, DECLARED, NOMINAL, OWN, RIGID, MeasuredPoints, errors_before
from .measured_orientations import (
    OrientationErrors,
    orientation_document,
    orientation_errors,
    uncalibrated_orientations,
)
from .measured_tilts import MILLIRADIAN, MeasuredTilts, TiltStatistics, tilt_differences
from .refitted_placement import Refit, RefittedVerification, verify_refitted
from .socket_contacts import (
    SocketDistance,
    SocketVerification,
    repeated_contacts,
    require_contacts,
    verify_contacts,
)
from .uncalibrated_robot import UncalibratedErrors, uncalibrated_model
from .unseen_poses import (
    ErrorCovariance,
    PredictionErrors,
    prediction_errors,
    prediction_errors_with_covariance,
)

__all__ = [
    "CALIBRATED",
    "DECLARED",
    "MILLIRADIAN",
    "NOMINAL",
    "OWN",
    "RIGID",
    "ArmPoses",
    "ErrorCovariance",
    "ErrorScale",
    "MeasuredPoints",
    "MeasuredTilts",
    "OrientationErrors",
    "PredictionErrors",
    "Refit",
    "RefittedVerification",
    "SocketDistance",
    "SocketVerification",
    "TiltStatistics",
    "UncalibratedErrors",
    "arms_at",
    "best_placement",
    "can_register",
    "can_register_with_points",
    "error_scale",
    "errors_before",
    "evenly",
    "orientation_document",
    "orientation_errors",
    "prediction_document",
    "prediction_errors",
    "prediction_errors_with_covariance",
    "repeated_contacts",
    "require_contacts",
    "rigid_placement",
    "tilt_differences",
    "uncalibrated_model",
    "uncalibrated_orientations",
    "verify_contacts",
    "verify_refitted",
]
