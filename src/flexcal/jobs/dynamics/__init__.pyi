from .gains import identify_gains
from .identification import identify_dynamics
from .inertials import identify_inertials_from_recordings, identify_robot_inertials
from .job import identify_robot_dynamics
from .result import DynamicsIdentification

__all__ = [
    "DynamicsIdentification",
    "identify_dynamics",
    "identify_gains",
    "identify_inertials_from_recordings",
    "identify_robot_dynamics",
    "identify_robot_inertials",
]
