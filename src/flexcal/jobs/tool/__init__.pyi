from .identification import identify_tip
from .job import identify_tool
from .result import ToolIdentification

__all__ = [
    "ToolIdentification",
    "identify_tip",
    "identify_tool",
]
