from .certificate import Certificate, certify, certify_robot
from .repeated_visits import Repeatability, repeatability, robot_repeatability
from .verification import Verification, verify, verify_robot
from .volume_map import AccuracyMap, accuracy_map, map_accuracy

__all__ = [
    "AccuracyMap",
    "Certificate",
    "Repeatability",
    "Verification",
    "accuracy_map",
    "certify",
    "certify_robot",
    "map_accuracy",
    "repeatability",
    "robot_repeatability",
    "verify",
    "verify_robot",
]
