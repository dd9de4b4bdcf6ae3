from .gains import identify_gains
from .inertials import identify_inertials_from_recordings, identify_robot_inertials
from .job import identify_robot_dynamics
from .result import RobotDynamics

__all__ = [
    "RobotDynamics",
    "identify_gains",
    "identify_inertials_from_recordings",
    "identify_robot_dynamics",
    "identify_robot_inertials",
]
