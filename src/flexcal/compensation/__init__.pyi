from .desired_poses import desired_pose
from .start_postures import best_posture
from .target_commands import Compensation, compensate

__all__ = [
    "Compensation",
    "best_posture",
    "compensate",
    "desired_pose",
]
