from .desired_poses import desired_pose
from .start_postures import best_posture
from .target_commands import MotorCommands, motor_commands

__all__ = [
    "MotorCommands",
    "best_posture",
    "desired_pose",
    "motor_commands",
]
