from .converter import structure
from .faults import MisfitError
from .keys import Keys, dotted, file_key
from .wording import suggestion

__all__ = [
    "Keys",
    "MisfitError",
    "dotted",
    "file_key",
    "structure",
    "suggestion",
]
