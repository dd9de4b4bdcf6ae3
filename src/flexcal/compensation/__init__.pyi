from .commands import Compensation, compensate
from .postures import best_posture
from .wanted import wanted_pose

__all__ = ["Compensation", "best_posture", "compensate", "wanted_pose"]
