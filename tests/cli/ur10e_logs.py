"""Recordings of a UR10e and what was published with them (Frontiers in Robotics and AI 2020, 571574).

Without a licence they are not part of this repository: FLEXCAL_DATASETS names the folder with `ur10e` in it.
"""

import os
from pathlib import Path

import numpy as np
import polars as pl
import pytest

FOLDER = Path(os.environ.get("FLEXCAL_DATASETS", "")) / "ur10e"
PUBLISHED = FOLDER / "UR10E_parameters.txt"
COLUMNS = ["t", *(f"q{i + 1}" for i in range(6)), *(f"i{i + 1}" for i in range(6))]

at_hand = pytest.mark.skipif(
    not PUBLISHED.exists(), reason="FLEXCAL_DATASETS names no folder with the recordings of the UR10e"
)


def published_gains() -> np.ndarray:
    """Those of the drives (6,), N m/A."""
    line = next(row for row in PUBLISHED.read_text().splitlines() if row.startswith("drvGains = ["))
    return np.array(line[line.index("[") + 1 : line.index("]")].split(), dtype=float)


def log(name: str, rows: slice) -> pl.DataFrame:
    """Time, joint positions and measured currents in these rows of a recording."""
    table = np.loadtxt(FOLDER / name, delimiter=",")[rows]
    return pl.DataFrame(np.column_stack([table[:, :7], table[:, 13:19]]), schema=COLUMNS)
