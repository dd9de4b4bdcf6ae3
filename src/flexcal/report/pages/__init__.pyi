from .accuracy_map import MapStudy, write_map_page
from .calibration import CalibrationStudy, calibration_checks, write_calibration_report
from .certificate import CertificateStudy, write_certificate
from .customer import CustomerStudy, write_customer_report
from .drive_gains import write_gains_report
from .dynamics import DynamicsStudy, dynamics_checks, write_dynamics_report
from .excitation import ExcitationStudy, write_excitation_report
from .frequency_design import FrequencyDesignStudy, write_frequency_page
from .frequency_response import ResponseStudy, write_response_report
from .inertials import InertialsStudy, inertials_checks, write_inertials_report
from .payload import PayloadStudy, write_payload_report
from .pose_design import PoseStudy, write_pose_page
from .repeatability import RepeatabilityStudy, write_repeatability_report
from .run_comparison import write_comparison
from .stiffness import StiffnessStudy, stiffness_checks, write_stiffness_report
from .trajectory_design import write_trajectory_page
from .two_stage import two_stage_checks, write_two_stage_report
from .verification import VerificationStudy, verification_checks, write_verification_report

__all__ = [
    "CalibrationStudy",
    "CertificateStudy",
    "CustomerStudy",
    "DynamicsStudy",
    "ExcitationStudy",
    "FrequencyDesignStudy",
    "InertialsStudy",
    "MapStudy",
    "PayloadStudy",
    "PoseStudy",
    "RepeatabilityStudy",
    "ResponseStudy",
    "StiffnessStudy",
    "VerificationStudy",
    "calibration_checks",
    "dynamics_checks",
    "inertials_checks",
    "stiffness_checks",
    "two_stage_checks",
    "verification_checks",
    "write_calibration_report",
    "write_certificate",
    "write_comparison",
    "write_customer_report",
    "write_dynamics_report",
    "write_excitation_report",
    "write_frequency_page",
    "write_gains_report",
    "write_inertials_report",
    "write_map_page",
    "write_payload_report",
    "write_pose_page",
    "write_repeatability_report",
    "write_response_report",
    "write_stiffness_report",
    "write_trajectory_page",
    "write_two_stage_report",
    "write_verification_report",
]
