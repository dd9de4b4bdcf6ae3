"""The column `excluded` of measured poses: rows with a reason are left out, and it is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from refusals import refused

from flexcal import RobotModel, calibrate, read_poses
from flexcal.data.poses import read_grouped_poses, read_pose_pool


def table(
    folder: Path, reasons: dict[int, str], *, suffix: str = ".csv", source: str = "ur5_tracker/random.csv"
) -> Path:
    examples = Path(__file__).parents[2] / "examples"
    frame = pl.read_csv(examples / source)
    column = pl.Series("excluded", [reasons.get(k) for k in range(len(frame))], dtype=pl.String)
    frame, path = frame.with_columns(column), folder / f"poses{suffix}"
    frame.write_csv(path) if suffix == ".csv" else frame.write_parquet(path)
    return path


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_rows_with_a_reason_are_left_out(tmp_path: Path, suffix: str, ur5: RobotModel, examples: Path):
    every = read_poses(examples / "ur5_tracker" / "random.csv", ur5)
    poses = read_poses(
        table(tmp_path, {2: "tripod bumped", 5: "ball, dirty", 6: "ball, dirty", 9: "?"}, suffix=suffix), ur5
    )
    kept = np.delete(np.arange(20), [2, 5, 6, 9])
    assert np.array_equal(poses.q, every.q[kept]) and np.array_equal(poses.position, every.position[kept])
    number = every.pose[[2, 5, 6]]
    assert poses.notes == (
        f"poses{suffix}: 4 rows are excluded: pose {number[0]} 'tripod bumped', pose {number[1]} 'ball, dirty', "
        f"pose {number[2]} 'ball, dirty' and 1 more",
    )
    assert len(read_pose_pool(tmp_path / f"poses{suffix}", ur5)) == 16


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_an_empty_column_says_nothing(tmp_path: Path, suffix: str, ur5: RobotModel):
    poses = read_poses(table(tmp_path, {}, suffix=suffix), ur5)
    assert len(poses) == 20 and poses.notes == ()


def test_calibrate_says_it(tmp_path: Path, ur5: RobotModel):
    poses = read_poses(table(tmp_path, {0: "warm-up"}), ur5)
    calibration = calibrate(ur5, poses, terms=["offsets"])
    assert poses.notes[0].endswith("'warm-up'") and poses.notes[0] in calibration.summary()


def test_all_excluded_and_no_reasons(tmp_path: Path, ur5: RobotModel):
    with refused("E-POSES-080", "20", "moved"):
        read_poses(table(tmp_path, dict.fromkeys(range(20), "moved")), ur5)
    with refused("E-POSES-079", "line 5", "no"):
        read_poses(table(tmp_path, {3: "no"}), ur5)


def test_errors_name_the_line_of_the_file(tmp_path: Path, ur5: RobotModel):
    path = table(tmp_path, {0: "early", 1: "early"})
    lines = path.read_text().splitlines()
    cells = lines[6].split(",")
    cells[lines[0].split(",").index("x")] = "250.0"
    lines[6] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")
    with refused("E-POSES-007", "line 7"):
        read_poses(path, ur5)
    # unless that row is excluded
    lines[6] += "in mm"
    path.write_text("\n".join(lines) + "\n")
    assert len(read_poses(path, ur5)) == 17


def test_groups_of_the_rows_that_are_used(tmp_path: Path, ur5: RobotModel):
    path = table(tmp_path, {1: "late"})
    frame = pl.read_csv(path).with_columns(pl.Series("day", [f"d{k // 10}" for k in range(20)]))
    frame.write_csv(path)
    poses, labels = read_grouped_poses([path], ur5, "day")
    assert len(poses) == 19 and labels.tolist() == ["d0"] * 9 + ["d1"] * 10
    with refused("E-POSES-081", "excluded"):
        read_grouped_poses([path], ur5, "excluded")


def test_several_targets_and_sockets(tmp_path: Path, ur5: RobotModel, examples: Path):
    panda = examples / "panda_sockets"
    source = next(
        file for file in sorted(panda.glob("*.csv")) if "socket" in file.read_text().splitlines()[0]
    )
    model = RobotModel.from_yaml(panda / "robot.yaml", estimates=False)
    every = read_poses(source, model)
    path = table(tmp_path, {0: "slipped out"}, source=f"panda_sockets/{source.name}")
    poses = read_poses(path, model)
    assert len(poses) == len(every) - 1 and np.array_equal(poses.q, every.q[1:])
    assert "slipped out" in poses.notes[0]
