"""Small studies on the robots of the examples."""

from __future__ import annotations

from pathlib import Path

import polars

from flexcal.files.formats import write_yaml

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
UR5 = EXAMPLES / "ur5_tracker"


def write_study(folder: Path, **changes: object) -> Path:
    """Two robots, calibrated at 10 or at 12 poses."""
    declared = {
        "kind": "virtual_calibration",
        "robot": str(UR5 / "robot.yaml"),
        "seeds": {"count": 2},
        "options": {"verification_poses": 10},
        "grid": {"poses": [10, 12]},
    }
    declared |= changes
    path = folder / "study.yaml"
    write_yaml(path, {name: value for name, value in declared.items() if value is not None})
    return path


def stored(folder: Path) -> polars.DataFrame:
    """All rows of a study, without what differs from run to run."""
    return polars.read_parquet(folder / "tasks.parquet").drop("seconds")
