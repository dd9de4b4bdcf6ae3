from .certificate import certify_robot
from .repeatability import repeat_robot
from .verification import Verification, verify, verify_robot
from .volume_map import AccuracyMap, accuracy_map, map_accuracy

__all__ = [
    "AccuracyMap",
    "Verification",
    "accuracy_map",
    "certify_robot",
    "map_accuracy",
    "repeat_robot",
    "verify",
    "verify_robot",
]
