"""A table of another program, with its own names and units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from flexcal.data.tables import Table


@dataclass(frozen=True, eq=False)
class ForeignTable:
    """The columns of a file, unchanged.

    table: numbers (N,), NaN where a cell is empty or holds something else, and texts (N,). units: what the file says of columns beside
    their names, as in a row under the header. named: False where there is no header, so that the columns are called c1, c2, …
    notes: what was done or left out in reading, a sentence each. times: columns that held timestamps and now seconds from the first.
    """

    table: Table
    units: Mapping[str, str] = field(default_factory=dict)
    named: bool = True
    notes: tuple[str, ...] = ()
    times: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.table)

    @property
    def numbers(self) -> dict[str, np.ndarray]:
        """The columns (N,) that hold numbers."""
        return {name: values for name, values in self.table.columns.items() if values.dtype.kind == "f"}

    @property
    def texts(self) -> dict[str, np.ndarray]:
        """The columns (N,) that hold texts."""
        return {name: values for name, values in self.table.columns.items() if values.dtype.kind == "U"}
