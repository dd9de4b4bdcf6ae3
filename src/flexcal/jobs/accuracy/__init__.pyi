from .certificate import certify_robot
from .repeatability import repeat_robot
from .verification import verify_robot
from .volume_map import map_accuracy

__all__ = [
    "certify_robot",
    "map_accuracy",
    "repeat_robot",
    "verify_robot",
]
