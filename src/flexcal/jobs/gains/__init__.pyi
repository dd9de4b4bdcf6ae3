from .identification import identify_gains
from .job import identify_robot_gains
from .result import GainsIdentification

__all__ = [
    "GainsIdentification",
    "identify_gains",
    "identify_robot_gains",
]
