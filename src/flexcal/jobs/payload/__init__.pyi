from .identification import identify_payload
from .job import identify_robot_payload
from .result import PayloadIdentification

__all__ = [
    "PayloadIdentification",
    "identify_payload",
    "identify_robot_payload",
]
