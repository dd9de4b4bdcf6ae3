from .checks import payload_masses, require_joint_torques, require_no_wrenches, weight_faults
from .given_logs import JointLogs, log_files, log_names, model_for_logs
from .hold_out import HoldOutLogs
from .preprocessing import Preprocessing, choose_preprocessing, preprocessing_document, preprocessing_remarks
from .regression_systems import LogSegment, assemble_joined_systems, assemble_log_systems
from .scratch import scratch_folder
from .torque_predictions import predict_log_torques
from .worker_files import worker_robot
from .worker_logs import read_logs

__all__ = [
    "HoldOutLogs",
    "JointLogs",
    "LogSegment",
    "Preprocessing",
    "assemble_joined_systems",
    "assemble_log_systems",
    "choose_preprocessing",
    "log_files",
    "log_names",
    "model_for_logs",
    "payload_masses",
    "predict_log_torques",
    "preprocessing_document",
    "preprocessing_remarks",
    "read_logs",
    "require_joint_torques",
    "require_no_wrenches",
    "scratch_folder",
    "weight_faults",
    "worker_robot",
]
