from .certificate import Certificate, certify, certify_robot
from .map_table import MapTable, worst_places
from .motor_zeros import MotorZeros, ZerosVerdict, export_motor_zeros
from .repeated_visits import Repeatability, repeatability, robot_repeatability
from .verification import Verification, verify, verify_robot
from .volume_map import AccuracyMap, accuracy_map, map_accuracy

__all__ = [
    "AccuracyMap",
    "Certificate",
    "MapTable",
    "MotorZeros",
    "Repeatability",
    "Verification",
    "ZerosVerdict",
    "accuracy_map",
    "certify",
    "certify_robot",
    "export_motor_zeros",
    "map_accuracy",
    "repeatability",
    "robot_repeatability",
    "verify",
    "verify_robot",
    "worst_places",
]
