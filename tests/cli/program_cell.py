"""The calibration and verification of the cells that robot programs are tried in, by the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flexcal.cli.main import main


def calibrate_cell(folder: Path) -> None:
    """Calibrate robot.yaml by points.csv, to the folder `out`."""
    robot = str(folder / "robot.yaml")
    assert main(["calibrate", robot, str(folder / "points.csv"), "--out", str(folder / "out")]) == 0


def verified_error(folder: Path, capsys: pytest.CaptureFixture[str]) -> float:
    """Mean error, m, that the verification by others.csv measures."""
    capsys.readouterr()
    estimates = ["--estimates", str(folder / "out"), "--json"]
    assert main(["verify", str(folder / "robot.yaml"), str(folder / "others.csv"), *estimates]) == 0
    return json.loads(capsys.readouterr().out)["verification"]["measured"]["mean_mm"] * 1e-3
