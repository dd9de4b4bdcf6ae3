from .identification import identify_work_object
from .job import identify_frame
from .result import FrameIdentification

__all__ = [
    "FrameIdentification",
    "identify_frame",
    "identify_work_object",
]
