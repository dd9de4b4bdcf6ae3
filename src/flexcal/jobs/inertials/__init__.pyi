from .identification import identify_inertials
from .job import identify_robot_inertials
from .result import InertialsIdentification

__all__ = [
    "InertialsIdentification",
    "identify_inertials",
    "identify_robot_inertials",
]
