from .calibration import CalibrationStudy, write_calibration_report
from .dynamics import DynamicsStudy, write_dynamics_report
from .fitted_response import FittedResponse, fitted_responses
from .publication import TX90L_PAPER, Publication
from .study import TwoStageStudy
from .two_stage import write_two_stage_report
from .verification import VerificationStudy, write_verification_report

__all__ = [
    "TX90L_PAPER",
    "CalibrationStudy",
    "DynamicsStudy",
    "FittedResponse",
    "Publication",
    "TwoStageStudy",
    "VerificationStudy",
    "fitted_responses",
    "write_calibration_report",
    "write_dynamics_report",
    "write_two_stage_report",
    "write_verification_report",
]
