from .checks import log_payloads, require_joint_torques, require_no_wrenches, weight_faults
from .hold_out import DividedLogs
from .preprocessing import Treatment, signal_sentences, treatment_of, used_signals
from .regression_systems import LogPart, log_systems, read_logs
from .scratch import scratch_folder
from .torque_predictions import log_predictions

__all__ = [
    "DividedLogs",
    "LogPart",
    "Treatment",
    "log_payloads",
    "log_predictions",
    "log_systems",
    "read_logs",
    "require_joint_torques",
    "require_no_wrenches",
    "scratch_folder",
    "signal_sentences",
    "treatment_of",
    "used_signals",
    "weight_faults",
]
