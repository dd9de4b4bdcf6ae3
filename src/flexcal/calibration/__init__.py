"""Stage 2: geometry from measured points, with the elastic deflection taken into account, and its verification."""

from flexcal.calibration.calibrate import Calibration, calibrate
from flexcal.calibration.drift import Drift
from flexcal.calibration.elastic_prior import ElasticPrior
from flexcal.calibration.error_statistics import ErrorStatistics
from flexcal.calibration.measured_points import require_points
from flexcal.calibration.plausibility import Moved, moved_far
from flexcal.calibration.prediction import Prediction, predict
from flexcal.calibration.registration import register, rigid_motion
from flexcal.calibration.term_selection import TermSelection, select_terms
from flexcal.calibration.terms import geometric_parameters
from flexcal.calibration.verification import Verification, verify

__all__ = [
    "Calibration",
    "Drift",
    "ElasticPrior",
    "ErrorStatistics",
    "Moved",
    "Prediction",
    "TermSelection",
    "Verification",
    "calibrate",
    "geometric_parameters",
    "moved_far",
    "predict",
    "register",
    "require_points",
    "rigid_motion",
    "select_terms",
    "verify",
]
