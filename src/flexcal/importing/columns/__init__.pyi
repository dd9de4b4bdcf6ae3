from .assignment import PlacedColumns
from .excitation_records import ResponseRecords, read_response_records
from .map_option import apply_map
from .nominal_consistency import Misfit, check_nominal
from .recognition import Guess, LeftOut, guess_columns, reasons_of
from .rtde_names import TOOL

__all__ = [
    "TOOL",
    "Guess",
    "LeftOut",
    "Misfit",
    "PlacedColumns",
    "ResponseRecords",
    "apply_map",
    "check_nominal",
    "guess_columns",
    "read_response_records",
    "reasons_of",
]
