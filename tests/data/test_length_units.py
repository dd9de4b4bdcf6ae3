"""Points that cannot be in m are said to be in the unit that brings them to the robot, whatever that is."""

from __future__ import annotations

from pathlib import Path

import polars
import pytest

from flexcal.data.poses import read_poses, read_targets
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel

UR5 = Path(__file__).parent.parent.parent / "examples" / "ur5_tracker"
UNITS = {"millimetres": ("mm", 1e-3), "centimetres": ("cm", 1e-2), "inches": ("in", 25.4e-3)}


def written_in(metres: float, folder: Path) -> Path:
    """The measured poses of the UR5 with numbers of points that are so many metres each."""
    table = polars.read_csv(UR5 / "random.csv")
    path = folder / "points.csv"
    table.with_columns(polars.col("x", "y", "z") / metres).write_csv(path)
    return path


@pytest.mark.parametrize("word", list(UNITS))
def test_measured_points_in_another_unit(word: str, tmp_path: Path) -> None:
    unit, metres = UNITS[word]
    model = RobotModel.from_yaml(UR5 / "robot.yaml", estimates=False)
    with pytest.raises(InputError, match=rf"these look like {word}: .*'unit: {unit}' under") as told:
        read_poses(written_in(metres, tmp_path), model)
    assert told.value.code == "E-POSES-007"


def test_targets_in_another_unit(tmp_path: Path) -> None:
    """Of those no joint positions tell the extent: where two units are possible both are named."""
    model = RobotModel.from_yaml(UR5 / "robot.yaml", estimates=False)

    def said(metres: float, distance: float) -> str:
        path = tmp_path / "targets.csv"
        path.write_text(f"pose,x,y,z\n1,{distance / metres},0.1,0.3\n2,{distance / metres},-0.1,0.3\n")
        with pytest.raises(InputError) as told:
            read_targets(path, model)
        return str(told.value)

    assert "these look like millimetres: " in said(1e-3, 0.5)
    assert "these look like centimetres or inches: " in said(25.4e-3, 0.45)
    assert "'unit: cm' or 'unit: in'" in said(25.4e-3, 0.45)
