from .bearing_axes import BearingAxes, compare_bearings
from .before import ErrorsBefore, RobotBefore, robot_before
from .drift import Drift
from .elastic_prior import ElasticPrior
from .error_statistics import ErrorStatistics
from .even_sample import EvenSample, all_errors
from .gauge import POINT_KNOWN, found_point, point_uncertainty, probable_robot, probable_robots
from .geometric_calibration import Calibration, calibrate
from .mapped_accuracy import AccuracyMap, accuracy_map, random_poses_in
from .placement import Placement, best_placement, enough_for_points, registrable, rigid_placement
from .plausibility import Moved, hardly_fits, moved_far, scattered
from .pose_drift import VISITS_A_SET, PoseDrift, common_way, drift_of_poses
from .pose_repeatability import CYCLES, PoseRepeatability, noise_repeatability, repeatability
from .prediction import Prediction, predict, predicted_positions, require_points
from .propagated_covariance import Propagation, propagation
from .refit import Refit, Refitted, refitted
from .registration import register, rigid_motion
from .scaled_errors import ErrorScale, error_scale, prediction_document
from .scatter import Scatter
from .sources import error_sources
from .term_selection import CrossValidation, TermSelection, cross_validated, select_terms
from .term_trials import ConsideredTerm
from .terms import geometric_parameters
from .verification import ErrorCovariance, Verification, verify, verify_jointly

__all__ = [
    "CYCLES",
    "POINT_KNOWN",
    "VISITS_A_SET",
    "AccuracyMap",
    "BearingAxes",
    "Calibration",
    "ConsideredTerm",
    "CrossValidation",
    "Drift",
    "ElasticPrior",
    "ErrorCovariance",
    "ErrorScale",
    "ErrorStatistics",
    "ErrorsBefore",
    "EvenSample",
    "Moved",
    "Placement",
    "PoseDrift",
    "PoseRepeatability",
    "Prediction",
    "Propagation",
    "Refit",
    "Refitted",
    "RobotBefore",
    "Scatter",
    "TermSelection",
    "Verification",
    "accuracy_map",
    "all_errors",
    "best_placement",
    "calibrate",
    "common_way",
    "compare_bearings",
    "cross_validated",
    "drift_of_poses",
    "enough_for_points",
    "error_scale",
    "error_sources",
    "found_point",
    "geometric_parameters",
    "hardly_fits",
    "moved_far",
    "noise_repeatability",
    "point_uncertainty",
    "predict",
    "predicted_positions",
    "prediction_document",
    "probable_robot",
    "probable_robots",
    "propagation",
    "random_poses_in",
    "refitted",
    "register",
    "registrable",
    "repeatability",
    "require_points",
    "rigid_motion",
    "rigid_placement",
    "robot_before",
    "scattered",
    "select_terms",
    "verify",
    "verify_jointly",
]
