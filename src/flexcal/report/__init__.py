"""The one-file HTML reports: what was found, how sure it is, and where it came from, for engineers who have not read the paper."""

from flexcal.report.calibration import CalibrationStudy, write_calibration_report
from flexcal.report.dynamics import DynamicsStudy, write_dynamics_report
from flexcal.report.publication import TX90L_PAPER, Publication
from flexcal.report.study import TwoStageStudy
from flexcal.report.two_stage import write_two_stage_report
from flexcal.report.verification import VerificationStudy, write_verification_report

__all__ = [
    "TX90L_PAPER",
    "CalibrationStudy",
    "DynamicsStudy",
    "Publication",
    "TwoStageStudy",
    "VerificationStudy",
    "write_calibration_report",
    "write_dynamics_report",
    "write_two_stage_report",
    "write_verification_report",
]
