"""The UR5 of the examples, calibrated on some of its poses, with the others to verify on."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import polars as pl

from flexcal.cli.main import main

EXAMPLE = Path(__file__).parents[2] / "examples" / "ur5_tracker"


def make(folder: Path, *, nearest: int | None = None) -> Path:
    """Make it in `folder`: robot.yaml, grid.csv, random.csv, and the folder `calibration`.

    The grid has every 13th pose of the example's, or the `nearest` to its middle one by joint positions.
    """
    folder.mkdir(parents=True)
    for name in ("robot.yaml", "ur5.urdf", "random.csv"):
        shutil.copy(EXAMPLE / name, folder)
    lines = (EXAMPLE / "grid.csv").read_text().splitlines(keepends=True)
    rows = lines[1::13]
    if nearest is not None:
        q = pl.read_csv(EXAMPLE / "grid.csv").select(pl.col("^q[1-6]$")).to_numpy()
        away = np.linalg.norm(q - q[len(q) // 2], axis=1)
        rows = [lines[1 + k] for k in sorted(np.argsort(away, kind="stable")[:nearest])]
    (folder / "grid.csv").write_text("".join([lines[0], *rows]))
    arguments = ["calibrate", str(folder / "robot.yaml"), str(folder / "grid.csv"), "--terms", "kinematic"]
    assert main([*arguments, "--out", str(folder / "calibration"), "--json"]) == 0
    return folder
