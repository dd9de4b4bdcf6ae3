from .converter import structure
from .faults import StructureError
from .keys import Keys, dotted, file_key
from .wording import UNQUOTED, suggestion

__all__ = [
    "UNQUOTED",
    "Keys",
    "StructureError",
    "dotted",
    "file_key",
    "structure",
    "suggestion",
]
