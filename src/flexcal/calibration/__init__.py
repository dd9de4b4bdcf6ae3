"""Stage 2: geometry from measured points, with the elastic deflection taken into account, and its verification."""

from flexcal.calibration.accuracy_map import AccuracyMap, accuracy_map, random_poses_in
from flexcal.calibration.calibrate import Calibration, calibrate
from flexcal.calibration.drift import Drift
from flexcal.calibration.elastic_prior import ElasticPrior
from flexcal.calibration.error_scale import ErrorScale, error_scale
from flexcal.calibration.error_sources import error_sources
from flexcal.calibration.error_statistics import ErrorStatistics
from flexcal.calibration.measured_points import require_points
from flexcal.calibration.plausibility import Moved, moved_far
from flexcal.calibration.prediction import Prediction, predict
from flexcal.calibration.propagation import Propagation, propagation
from flexcal.calibration.registration import register, rigid_motion
from flexcal.calibration.repeatability import (
    CYCLES,
    PoseRepeatability,
    noise_repeatability,
    repeatability,
)
from flexcal.calibration.term_selection import TermSelection, select_terms
from flexcal.calibration.terms import geometric_parameters
from flexcal.calibration.verification import Verification, verify, verify_jointly

__all__ = [
    "CYCLES",
    "AccuracyMap",
    "Calibration",
    "Drift",
    "ElasticPrior",
    "ErrorScale",
    "ErrorStatistics",
    "Moved",
    "PoseRepeatability",
    "Prediction",
    "Propagation",
    "TermSelection",
    "Verification",
    "accuracy_map",
    "calibrate",
    "error_scale",
    "error_sources",
    "geometric_parameters",
    "moved_far",
    "noise_repeatability",
    "predict",
    "propagation",
    "random_poses_in",
    "register",
    "repeatability",
    "require_points",
    "rigid_motion",
    "select_terms",
    "verify",
    "verify_jointly",
]
