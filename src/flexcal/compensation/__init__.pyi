from .desired_poses import wanted_pose
from .start_postures import best_posture
from .target_commands import Compensation, compensate

__all__ = [
    "Compensation",
    "best_posture",
    "compensate",
    "wanted_pose",
]
