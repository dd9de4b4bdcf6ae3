"""The table of a fleet: one row a value of a result (docs/file-formats.md, "Table of a fleet")."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from flexcal.data.tables import write_frame

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True)
class Row:
    """One value; lengths in m, and all else in SI units as in the table of parameter names."""

    robot: str
    serial: str | None
    model: str
    urdf: str
    tolerance: float | None
    folder: str
    date: datetime | None
    modified: datetime
    kind: str
    name: str
    value: float | None
    std: float | None
    unit: str
    text: str | None
    identifiable: bool
    prior_share: float | None
    of_robot: bool | None
    absorbs: str
    terms: str
    data: str
    calibration: str | None
    independent: bool | None
    temperature: float | None
    file: str
    sha256: str


@dataclass(frozen=True, eq=False)
class FleetTable:
    """Table of a fleet, one row a value of a result.

    Attributes
    ----------
    frame : polars.DataFrame
        The columns of the documentation's table.
    """

    frame: pl.DataFrame

    @classmethod
    def of(cls, rows: Iterable[Row]) -> FleetTable:
        """Table of rows.

        Parameters
        ----------
        rows : iterable of Row
            The rows.

        Returns
        -------
        FleetTable
            The table.
        """
        import polars as pl

        kinds = {
            "float | None": pl.Float64,
            "bool": pl.Boolean,
            "bool | None": pl.Boolean,
            "datetime": pl.Datetime("ms"),
            "datetime | None": pl.Datetime("ms"),
        }
        schema = {field.name: kinds.get(str(field.type), pl.String) for field in fields(Row)}
        names = tuple(schema)
        data = list(rows)
        return cls(pl.DataFrame({n: [getattr(row, n) for row in data] for n in names}, schema=schema))

    def write(self, path: Path) -> None:
        """Write it as CSV or Parquet by the suffix, atomically.

        Parameters
        ----------
        path : Path
            The file.
        """
        write_frame(path, self.frame)
