"""The UR5 of the examples, calibrated on some of its poses, with the others to verify on."""

from __future__ import annotations

import shutil
from pathlib import Path

from flexcal.cli.main import main

EXAMPLE = Path(__file__).parents[2] / "examples" / "ur5_tracker"


def make(folder: Path) -> Path:
    """Make it in `folder`: robot.yaml, grid.csv (every 13th pose of the example's), random.csv, and the folder `calibration`."""
    folder.mkdir(parents=True)
    for name in ("robot.yaml", "ur5.urdf", "random.csv"):
        shutil.copy(EXAMPLE / name, folder)
    lines = (EXAMPLE / "grid.csv").read_text().splitlines(keepends=True)
    (folder / "grid.csv").write_text("".join([lines[0], *lines[1::13]]))
    arguments = ["calibrate", str(folder / "robot.yaml"), str(folder / "grid.csv"), "--terms", "kinematic"]
    assert main([*arguments, "--out", str(folder / "calibration"), "--json"]) == 0
    return folder
