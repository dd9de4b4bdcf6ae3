from .desired_poses import desired_pose
from .nominal_postures import nominal_joint_positions
from .start_postures import best_posture
from .target_commands import MotorCommands, motor_commands
from .tool_target import ToolPoseTarget

__all__ = [
    "MotorCommands",
    "ToolPoseTarget",
    "best_posture",
    "desired_pose",
    "motor_commands",
    "nominal_joint_positions",
]
