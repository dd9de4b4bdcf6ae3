from .column_names import ColumnName, parse_name, unit_of
from .foreign_table import ForeignTable
from .header_rows import NUMBER, find_header
from .vocabulary import (
    CARTESIAN,
    COMMANDED,
    FORCE,
    JOINT,
    KINDS,
    NEUTRAL,
    NO_JOINT,
    NO_POINT,
    POINT,
    POSITION,
    SIGMA,
    SINGLE,
    SLIDING,
    TURN,
    rank,
)

__all__ = [
    "CARTESIAN",
    "COMMANDED",
    "FORCE",
    "JOINT",
    "KINDS",
    "NEUTRAL",
    "NO_JOINT",
    "NO_POINT",
    "NUMBER",
    "POINT",
    "POSITION",
    "SIGMA",
    "SINGLE",
    "SLIDING",
    "TURN",
    "ColumnName",
    "ForeignTable",
    "find_header",
    "parse_name",
    "rank",
    "unit_of",
]
