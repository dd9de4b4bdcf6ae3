from .identification import identify_actuators
from .job import identify_robot_actuators
from .result import ActuatorIdentification

__all__ = [
    "ActuatorIdentification",
    "identify_actuators",
    "identify_robot_actuators",
]
