from .assignment import ORIENTATIONS, ColumnAssignment
from .base_and_tilts import TILTS
from .excitation_records import ExcitationSource, ResponseRecords, read_response_records, record_paths
from .map_option import apply_map
from .nominal_consistency import NominalMismatch, check_nominal
from .recognition import RecognisedColumns, UnusedColumn, guess_columns, reasons_unused, require_known_units
from .rtde_names import TOOL

__all__ = [
    "ORIENTATIONS",
    "TILTS",
    "TOOL",
    "ColumnAssignment",
    "ExcitationSource",
    "NominalMismatch",
    "RecognisedColumns",
    "ResponseRecords",
    "UnusedColumn",
    "apply_map",
    "check_nominal",
    "guess_columns",
    "read_response_records",
    "reasons_unused",
    "record_paths",
    "require_known_units",
]
