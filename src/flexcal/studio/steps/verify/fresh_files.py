"""Files of measured poses that a calibration was not made from."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from flexcal.data.tables import LARGEST_TABLE, require_decodable
from flexcal.errors import InputError
from flexcal.files.transaction import regular_path
from flexcal.studio.project import CALIBRATION, CHECKED, Project, pose_files
from flexcal.studio.steps.results import ResultSource

_LOOKED_AT = 200
"""First rows of a table that are compared with those of the calibration."""
_POINT = ("x", "y", "z")
_RESOLUTION = 1e-7
"""Difference, rad or m, below which two numbers are the same."""


def fresh_files(project: Project) -> list[str]:
    """Names of tables of measured poses without rows of the calibration; that of a guided session first."""
    folder = project.folder / CALIBRATION
    source = ResultSource.read(folder)
    names = [
        name
        for name in pose_files(project)
        if (source is None or not source.names_table(name))
        and not _is_fitted(_stamped(project.folder / name), _stamped(folder / "points.csv"))
    ]
    return sorted(names, key=lambda name: name != CHECKED)


def _stamped(path: Path) -> tuple[Path, int]:
    """A path with the time of its change, ns; 0 where it is not there."""
    try:
        return path, path.stat().st_mtime_ns
    except OSError:
        return path, 0


@lru_cache(maxsize=256)
def _is_fitted(table: tuple[Path, int], points: tuple[Path, int]) -> bool:
    """Whether one of a table's first rows is a measurement, joint positions and point, of the calibration."""
    measured = set(_rows(points[0], None))
    return any(row in measured for row in _rows(table[0], _LOOKED_AT))


def _rows(path: Path, most: int | None) -> list[tuple[int, ...]]:
    """Joint positions and points of a table in units of the resolution; none where it cannot be read."""
    import polars as pl

    try:
        if path.suffix == ".parquet":
            require_decodable(path, stream=most is not None)
            table = pl.scan_parquet(regular_path(path, limit=None))
        else:
            table = pl.scan_csv(
                regular_path(path, limit=LARGEST_TABLE),
                infer_schema=False,
                comment_prefix="#",
                truncate_ragged_lines=True,
            )
        columns = [
            name
            for name in table.collect_schema().names()
            if name in _POINT or (name[:1] == "q" and name[1:].isdigit())
        ]
        numbers = table.select(sorted(columns)).cast(pl.Float64, strict=False)
        values = (numbers if most is None else numbers.head(most)).collect().to_numpy()
    except (pl.exceptions.PolarsError, OSError, InputError):
        return []
    values = values[np.isfinite(values).all(axis=1)]
    return [tuple(row) for row in np.round(values / _RESOLUTION).astype(np.int64).tolist()]
