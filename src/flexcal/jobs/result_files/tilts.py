"""File of the readings of inclinometers beside a calibration: tilts.csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.calibration.verification import MeasuredTilts
from flexcal.data.tables import LARGEST_TABLE
from flexcal.errors import unreadable
from flexcal.files.transaction import atomic_path, current_path, read_bytes
from flexcal.jobs.result_files.document import AGAIN

TILTS = "tilts.csv"
_MODELS = ("before", "calibrated")


def write_tilts(folder: Path, tilts: MeasuredTilts) -> None:
    """Write `tilts` to tilts.csv in `folder`, atomically: rad, or 1 of components; empty for axes without a reading."""
    import polars as pl

    columns: dict[str, np.ndarray] = {"pose": tilts.pose, "inclinometer": tilts.sensor}
    columns |= {f"q{i + 1}": tilts.q[:, i] for i in range(tilts.q.shape[1])}
    for model in _MODELS:
        errors = getattr(tilts, model)
        columns |= {f"{model}_d{axis}": errors[:, k] for k, axis in enumerate("xyz")}
    with atomic_path(folder / TILTS) as temporary, temporary.open("wb") as stream:
        pl.DataFrame(columns).fill_nan(None).write_csv(stream)


def read_tilts(folder: Path) -> MeasuredTilts | None:
    """Tilts from a file of `write_tilts`; None without it. Raises `InputError` where it is not such a one."""
    import polars as pl

    path = folder / TILTS
    if not current_path(path).is_file():
        return None
    try:
        table = pl.read_csv(
            read_bytes(path, limit=LARGEST_TABLE), schema_overrides={"inclinometer": pl.String}
        )
        joints = [name for name in table.columns if name.startswith("q") and name[1:].isdigit()]

        def numbers(columns: list[str]) -> np.ndarray:
            return table.select(columns).cast(pl.Float64).fill_null(np.nan).to_numpy()

        before, calibrated = (numbers([f"{model}_d{axis}" for axis in "xyz"]) for model in _MODELS)
        return MeasuredTilts(
            table["pose"].to_numpy(), numbers(joints), table["inclinometer"].to_numpy(), before, calibrated
        )
    except (pl.exceptions.PolarsError, OSError) as problem:
        raise unreadable(path, problem, AGAIN) from problem
