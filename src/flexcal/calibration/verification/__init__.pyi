from .arm_poses import ArmPoses, arms_at
from .best_fit_registration import Placement, best_placement, enough_for_points, registrable, rigid_placement
from .error_scale_test import ErrorScale, error_scale, prediction_document
from .errors_by_model import CALIBRATED, DECLARED, NOMINAL, OWN, RIGID, MeasuredPoints, errors_before
from .refitted_placement import Refit, Refitted, refitted
from .uncalibrated_robot import ErrorsBefore, RobotBefore, robot_before
from .unseen_poses import ErrorCovariance, Verification, verify, verify_jointly

__all__ = [
    "CALIBRATED",
    "DECLARED",
    "NOMINAL",
    "OWN",
    "RIGID",
    "ArmPoses",
    "ErrorCovariance",
    "ErrorScale",
    "ErrorsBefore",
    "MeasuredPoints",
    "Placement",
    "Refit",
    "Refitted",
    "RobotBefore",
    "Verification",
    "arms_at",
    "best_placement",
    "enough_for_points",
    "error_scale",
    "errors_before",
    "prediction_document",
    "refitted",
    "registrable",
    "rigid_placement",
    "robot_before",
    "verify",
    "verify_jointly",
]
