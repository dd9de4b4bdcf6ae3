from .accuracy_map import MapStudy, map_page
from .actuators import actuators_page
from .calibration import CalibrationStudy, calibration_page
from .certificate import CertificateStudy, write_certificate
from .customer import CustomerStudy, write_customer_report
from .drive_gains import gains_page
from .dynamics import DynamicsStudy, dynamics_page
from .excitation import ExcitationStudy, excitation_page
from .fleet import fleet_page
from .frequency_design import FrequencyDesignStudy, frequency_page
from .frequency_response import ResponseStudy, response_page
from .inclinations import InclinationStudy, inclination_page
from .inertials import InertialsStudy, inertials_checks, inertials_page
from .payload import PayloadStudy, payload_page
from .pose_design import PoseStudy, pose_page
from .program import ProgramStudy, program_page
from .recheck import RecheckStudy, recheck_page
from .repeatability import RepeatabilityStudy, repeatability_page
from .run_comparison import comparison_page
from .stiffness import StiffnessStudy, stiffness_checks, stiffness_page
from .study import StudyReport, study_page
from .trajectory_design import trajectory_page
from .two_stage import two_stage_checks, two_stage_page
from .verification import VerificationStudy, verification_page

__all__ = [
    "CalibrationStudy",
    "CertificateStudy",
    "CustomerStudy",
    "DynamicsStudy",
    "ExcitationStudy",
    "FrequencyDesignStudy",
    "InclinationStudy",
    "InertialsStudy",
    "MapStudy",
    "PayloadStudy",
    "PoseStudy",
    "ProgramStudy",
    "RecheckStudy",
    "RepeatabilityStudy",
    "ResponseStudy",
    "StiffnessStudy",
    "StudyReport",
    "VerificationStudy",
    "actuators_page",
    "calibration_page",
    "comparison_page",
    "dynamics_page",
    "excitation_page",
    "fleet_page",
    "frequency_page",
    "gains_page",
    "inclination_page",
    "inertials_checks",
    "inertials_page",
    "map_page",
    "payload_page",
    "pose_page",
    "program_page",
    "recheck_page",
    "repeatability_page",
    "response_page",
    "stiffness_checks",
    "stiffness_page",
    "study_page",
    "trajectory_page",
    "two_stage_checks",
    "two_stage_page",
    "verification_page",
    "write_certificate",
    "write_customer_report",
]
