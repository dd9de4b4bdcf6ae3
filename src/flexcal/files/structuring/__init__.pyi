from .converter import structure
from .faults import StructureError
from .keys import Keys, dotted, file_key
from .wording import suggestion

__all__ = [
    "Keys",
    "StructureError",
    "dotted",
    "file_key",
    "structure",
    "suggestion",
]
