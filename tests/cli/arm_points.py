"""Points of a tracker at poses of an arm as a file, and what a calibration with them promises of fresh ones."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from cli_files import write_csv

from flexcal.cli.main import main


def write_points(path: Path, q: np.ndarray, xyz: np.ndarray) -> Path:
    """Poses `q` (N, n) and points (N, 3) as CSV, without a word on noise."""
    joints = [f"q{k + 1}" for k in range(q.shape[1])]
    return write_csv(path, ["pose", *joints, "x", "y", "z"], np.column_stack([1 + np.arange(len(q)), q, xyz]))


def prediction_of(robot: Path, points: Path, checked: Path, *options: str) -> dict[str, Any]:
    """What `verify` says of the errors at the `checked` points beside those predicted by a calibration with the others."""
    with redirect_stdout(StringIO()):
        assert main(["calibrate", str(robot), str(points), *options]) == 0
    with redirect_stdout(StringIO()) as said:
        assert main(["verify", str(robot), str(checked), "--json"]) == 0
    return json.loads(said.getvalue())["prediction"]


def assert_intervals_cover(predictions: Sequence[dict[str, Any]]) -> None:
    """95 % intervals of fresh points of many arms, and the ratio of their errors to those predicted."""
    inside, ratios = ([own[key] for own in predictions] for key in ("inside_95_percent", "ratio"))
    assert 0.93 <= np.mean(inside) <= 0.97, np.mean(inside)
    assert 0.95 < np.mean(ratios) < 1.05, np.mean(ratios)
