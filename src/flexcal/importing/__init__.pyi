from .column_guess import Guess, LeftOut, guess_columns, reasons_of
from .foreign_files import read_foreign
from .foreign_table import ForeignTable
from .map_option import apply_map
from .nominal_fit import Misfit, check_nominal
from .placed_columns import PlacedColumns

__all__ = [
    "ForeignTable",
    "Guess",
    "LeftOut",
    "Misfit",
    "PlacedColumns",
    "apply_map",
    "check_nominal",
    "guess_columns",
    "read_foreign",
    "reasons_of",
]
