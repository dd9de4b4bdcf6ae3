"""A quantity of flexcal and the columns of a foreign file that hold it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.data.tables import UNITS, ZEROS, Signal, Table, standard_columns

NUMBERED = ("pose",)
"""Quantities that `signals:` does not map: files have them under their own names."""
ORIENTATIONS = {
    "rxyz": ("rx", "ry", "rz"),
    "angles": ("angle1", "angle2", "angle3"),
    "components": ("component1", "component2", "component3", "component4"),
}
"""Columns of orientations whose convention the nominal robot tells: of numbers about x, y and z, of angles in the order of turning, and of
quaternions in either order.
"""


def assigned_names(quantity: str, n: int) -> tuple[str, ...]:
    """The names that --map has for a quantity's columns in a file of an n-joint robot."""
    return ORIENTATIONS.get(quantity) or standard_columns(quantity, n)


def units_of(quantity: str) -> Mapping[str, float]:
    """Units of a quantity, and their factors to SI; numbers of an orientation are converted with their convention."""
    if quantity in ("rxyz", "angles"):
        return {"deg": 1.0, "rad": 1.0}
    return UNITS.get(quantity, {})


@dataclass(frozen=True)
class ColumnAssignment:
    """SI = (gain · column + offset + zero of the unit) · unit, one entry a column; `why` says how columns and units were recognised."""

    quantity: str
    columns: tuple[str, ...]
    units: tuple[str | None, ...]
    why: str
    gains: tuple[float, ...]
    offsets: tuple[float, ...]

    @classmethod
    def plain(
        cls, quantity: str, columns: tuple[str, ...], units: tuple[str | None, ...], why: str
    ) -> ColumnAssignment:
        """Columns that only have another name and unit."""
        n = len(columns)
        return cls(quantity, columns, units, why, (1.0,) * n, (0.0,) * n)

    @property
    def unit(self) -> str | None:
        """The unit that all columns share."""
        return self.units[0] if len(set(self.units)) == 1 else None

    def signal(self) -> Signal:
        """Conversion of the columns to SI values."""
        factors = np.array([_factor(self.quantity, unit) for unit in self.units])
        return Signal(
            self.quantity,
            self.columns,
            np.array(self.gains) * factors,
            None,
            (np.array(self.offsets) + [ZEROS.get(unit or "", 0.0) for unit in self.units]) * factors,
        )

    def values(self, table: Table) -> np.ndarray:
        """The quantity (N, m) in SI units."""
        return self.signal().values(table)

    def standard(self) -> bool:
        """Whether a file with these columns needs no `signals:` for them."""
        signal = self.signal()
        same = signal.columns == standard_columns(self.quantity, len(self.columns))
        return same and bool((signal.factor == 1).all()) and not signal.offset.any()

    def config(self) -> dict[str, Any]:
        """The entry of this quantity under `signals:`."""
        shared = len(set(self.units)) == 1
        signal = self.signal()
        gains = np.array(self.gains) if shared else signal.factor
        offsets = np.array(self.offsets) if shared else signal.offset
        entry: dict[str, Any] = {"columns": list(self.columns)}
        if shared and self.units[0] is not None:
            entry["unit"] = self.units[0]
        if (gains != 1).any() or self.units[0] in ("A", "mA"):
            entry["gain"] = gains.tolist()
        if offsets.any():
            entry["offset"] = offsets.tolist()
        return entry


def _factor(quantity: str, unit: str | None) -> float:
    return 1.0 if unit is None else units_of(quantity).get(unit, 1.0)
