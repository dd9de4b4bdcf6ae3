from .arm_side import ArmSide
from .bandwidth import MotionBandwidth, motion_bandwidth
from .experiment import Experiment, Window, slowest_speeds
from .external_torques import external_torque
from .joint_log import JointLog, log_blocks
from .log_faults import LogFaults
from .motion import AT_REST, BESIDE, Motion, between_gaps, differences, filtered_motion, smoothed, stretches
from .periodic_motion import PeriodicMotion, real_rows
from .repeated_motion import RepeatedMotion

__all__ = [
    "AT_REST",
    "BESIDE",
    "ArmSide",
    "Experiment",
    "JointLog",
    "LogFaults",
    "Motion",
    "MotionBandwidth",
    "PeriodicMotion",
    "RepeatedMotion",
    "Window",
    "between_gaps",
    "differences",
    "external_torque",
    "filtered_motion",
    "log_blocks",
    "motion_bandwidth",
    "real_rows",
    "slowest_speeds",
    "smoothed",
    "stretches",
]
