"""Files of other programs: what their columns are, in which units, and whether that can be true of this robot."""

from flexcal.importing.column_guess import Guess, LeftOut, guess_columns, reasons_of
from flexcal.importing.foreign_files import read_foreign
from flexcal.importing.foreign_table import ForeignTable
from flexcal.importing.map_option import apply_map
from flexcal.importing.nominal_fit import Misfit, check_nominal
from flexcal.importing.placed_columns import PlacedColumns

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
