from .identification import identify_dynamics
from .job import identify_robot_dynamics
from .result import DynamicsIdentification

__all__ = [
    "DynamicsIdentification",
    "identify_dynamics",
    "identify_robot_dynamics",
]
