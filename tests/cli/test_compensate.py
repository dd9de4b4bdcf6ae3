"""`flexcal compensate` and `flexcal predict` on the UR5's calibration, and on files that do not fit."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from cli_files import copied, read_csv, snapshot, write_csv
from refusals import assert_refusal

from flexcal.cli.main import main
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel

Q = [f"q{i}" for i in range(1, 7)]


@pytest.fixture(scope="module")
def calibrated(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A UR5 with rigid geometry fitted to its grid, and targets.csv: the commands of its random poses."""
    folder = copied(examples / "ur5_tracker", tmp_path_factory.mktemp("compensate") / "ur5")
    robot = folder / "robot.yaml"
    assert main(["calibrate", str(robot), str(folder / "grid.csv"), "--terms", "kinematic"]) == 0
    header, rows = read_csv(folder / "random.csv")
    write_csv(folder / "targets.csv", header[:7], rows[:, :7])
    return folder


@pytest.fixture
def ur5(calibrated: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(calibrated, tmp_path / "ur5"))


def positions(frame: pl.DataFrame) -> np.ndarray:
    return frame.select("x", "y", "z").to_numpy()


def test_there_and_back_through_files(run, ur5: Path) -> None:
    robot = ur5 / "robot.yaml"
    done = run("compensate", robot, ur5 / "targets.csv", "-o", ur5 / "commands.csv", "--json")
    assert done.status == 0 and "next: run " in done.err
    warm = run(
        "compensate", robot, ur5 / "targets.csv", "-o", ur5 / "warm.csv", "--temperature", "40", "--json"
    )
    assert warm.err.count("--temperature 40") == 2  # what verifies and what certifies the commands
    document = done.document
    assert document["targets"] == document["compensated"] == 20 and document["refused"] == []
    assert 1.5 < document["error_before_mm"]["mean_mm"] < 3.5
    commands = pl.read_csv(ur5 / "commands.csv")
    assert commands.columns == ["pose", *Q, "target", "unambiguous"]
    assert commands["unambiguous"].all()
    back = run("predict", robot, ur5 / "commands.csv", "--out", ur5 / "tool.parquet", "--json").document
    assert back["poses"] == 20 and back["ambiguous_poses"] == []
    tool = pl.read_parquet(ur5 / "tool.parquet")
    nominal = RobotModel.from_yaml(robot, estimates=False)
    wanted = pl.read_csv(ur5 / "targets.csv").select(Q).to_numpy()
    at, point = point_kinematics(nominal, wanted), document["points"]["smr"]
    shift = np.array(point["found_xyz_m"]) - np.array(point["declared_xyz_m"])
    assert np.abs(positions(tool) - (at.position + at.orientation @ shift)).max() < 1e-6
    start = [f"{value}" for value in wanted[0]]
    again = run("compensate", robot, ur5 / "tool.parquet", "--out", ur5 / "again.csv", "--start", *start)
    assert again.status == 0 and "targets without joint positions: shoulder_pan_joint 0.3015" in again.out
    np.testing.assert_allclose(
        pl.read_csv(ur5 / "again.csv").select(Q).to_numpy(), commands.select(Q).to_numpy(), atol=1e-7
    )


def test_what_cannot_be_reached_is_named_and_the_rest_is_written(run, ur5: Path) -> None:
    header, rows = read_csv(ur5 / "targets.csv")
    rows[3, 1], rows[7, 5] = 6.4, 1e-6
    targets = write_csv(ur5 / "hard.csv", header, rows)
    done = run("compensate", ur5 / "robot.yaml", targets, "--out", ur5 / "some.parquet")
    assert done.status == 0
    assert "left out: pose 7, line 9: singular: wrist_1_joint" in done.out
    assert (
        "left out: pose 3, line 5: joint limit: shoulder_pan_joint is 0.12 rad past its limit of 6.2832 rad"
        in done.out
    )
    assert "commands for 18 of 20 targets" in done.out
    kept = [int(pose) for pose in rows[:, 0] if pose not in (3, 7)]
    assert pl.read_parquet(ur5 / "some.parquet")["pose"].to_list() == kept


def test_where_nothing_can_be_reached_nothing_is_written(run, ur5: Path) -> None:
    targets = write_csv(ur5 / "far.csv", ["pose", "x", "y", "z"], np.array([[1, 4.0, 0.0, 0.0]]))
    before = snapshot(ur5)
    done = run("compensate", ur5 / "robot.yaml", targets, "--out", ur5 / "none.csv")
    assert done.status == 2 and done.err.count("E-RUN-016") == 1
    assert_refusal(
        done.err, "E-RUN-016", "1", "out of reach: the smallest distance of the tool to the target is"
    )
    assert snapshot(ur5) == before


@pytest.mark.parametrize(
    ("header", "row", "refusal"),
    [
        (["pose"], [1], ["E-POSES-027", "q1…q6"]),
        (["pose", *Q, "qw", "qx", "qy", "qz"], [1] + [0.1] * 6 + [1, 0, 0, 0], ["E-POSES-028", "quaternion"]),
        (["pose", "x", "y"], [1, 0.1, 0.2], ["E-TABLE-006", "z"]),
        (["pose", "x", "y", "z"], [1, 400.0, 200.0, 300.0], ["E-POSES-031", "column x", "538.5"]),
        (
            ["pose", "x", "y", "z", "qw", "qx", "qy", "qz"],
            [1, 0.4, 0.2, 0.3, 1, 1, 0, 0],
            ["E-POSES-014", "1.414"],
        ),
        (["pose", *Q], [1, 17.0, -80, 80, 0, 90, 0], ["E-TABLE-001", "these look like degrees"]),
        (["pose", *Q, "payload"], [1] + [0.1] * 6 + [3.0], ["E-POSES-009"]),
        (["pose", *Q, "sigma"], [1] + [0.1] * 6 + [3.0], ["E-TABLE-004", "sigma"]),
    ],
)
def test_targets_that_do_not_fit(
    run, ur5: Path, header: list[str], row: list[float], refusal: list[str]
) -> None:
    targets = write_csv(ur5 / "bad.csv", header, np.array([row], dtype=float))
    before = snapshot(ur5)
    done = run("compensate", ur5 / "robot.yaml", targets, "--out", ur5 / "none.csv")
    assert done.status == 2 and done.err.count("\n") == 1
    assert_refusal(done.err, *refusal)
    assert snapshot(ur5) == before


@pytest.mark.parametrize(
    ("column", "value", "refusal"),
    [
        ("target", "tcp", ["E-POSES-010", "line 2, column target", "tcp"]),
        ("station", "roof", ["E-POSES-030", "line 2, column station", "roof"]),
        ("target", "smr", ["E-POSES-029", "line 3, column pose: 1"]),
    ],
)
def test_names_that_do_not_fit(run, ur5: Path, column: str, value: str, refusal: list[str]) -> None:
    (ur5 / "bad.csv").write_text(f"pose,x,y,z,{column}\n" + 2 * f"1,0.4,0.2,0.3,{value}\n")
    done = run("compensate", ur5 / "robot.yaml", ur5 / "bad.csv", "--out", ur5 / "none.csv")
    assert done.status == 2
    assert_refusal(done.err, *refusal)


def test_measured_points_are_in_the_instruments_frame(run, ur5: Path) -> None:
    """Taken as they are they lie elsewhere, which is said; with the station named they are where the commands beside them lead."""
    measured = ur5 / "random.csv"
    done = run("compensate", ur5 / "robot.yaml", measured, "--out", ur5 / "none.csv")
    assert done.status == 2
    assert_refusal(done.err, "E-RUN-018")
    lines = measured.read_text().splitlines()
    (ur5 / "seen.csv").write_text(
        "\n".join([lines[0] + ",station", *(f"{row},tracker" for row in lines[1:])]) + "\n"
    )
    assert run("compensate", ur5 / "robot.yaml", ur5 / "seen.csv", "--out", ur5 / "there.csv").status == 0
    change = pl.read_csv(ur5 / "there.csv").select(Q).to_numpy() - pl.read_csv(measured).select(Q).to_numpy()
    assert np.abs(change).max() < 0.05  # what is left is the orientation, of which the nominal one is wanted


def test_starts_that_do_not_fit(run, ur5: Path) -> None:
    points = write_csv(ur5 / "points.csv", ["pose", "x", "y", "z"], np.array([[1, 0.4, 0.2, 0.3]]))
    for arguments, refusal in (
        ((points, "--start", "1", "2"), ["E-RUN-019", "2", "ur5", "6"]),
        (
            (points, "--start", "17", "-80", "80", "0", "90", "0"),
            ["E-RUN-020", "shoulder_pan_joint", "17"],
        ),
        (
            (ur5 / "targets.csv", "--start", *"000000"),
            ["E-RUN-015", "targets.csv"],
        ),
    ):
        done = run("compensate", ur5 / "robot.yaml", *arguments, "--out", ur5 / "none.csv")
        assert done.status == 2
        assert_refusal(done.err, *refusal)
    assert not (ur5 / "none.csv").exists()


def test_without_a_calibration(run, examples: Path, tmp_path: Path) -> None:
    folder = copied(examples / "ur5_tracker", tmp_path / "bare")
    for verb in ("compensate", "predict"):
        done = run(verb, folder / "robot.yaml", folder / "random.csv", "--out", tmp_path / "none.csv")
        assert done.status == 2
        assert_refusal(done.err, "E-RUN-055")


def test_commands_stand_in_the_columns_of_the_controller(run, ur5: Path) -> None:
    """Motor angles in degrees, mixed by a matrix: the same commands, in the same columns and unit."""
    mixed = np.eye(6)
    mixed[5, 4] = 0.5
    np.savetxt(ur5 / "joint_from_motor.csv", mixed, delimiter=",")
    plain = ur5 / "robot.yaml"
    motors = [f"m{i}" for i in range(1, 7)]
    mapped = ur5 / "mapped.yaml"
    signal = f"{{columns: [{', '.join(motors)}], unit: deg, matrix: joint_from_motor.csv, offset: [0, -90, 90, 0, 0, 0]}}"
    mapped.write_text(plain.read_text() + f"signals: {{q: {signal}}}\n")
    _, rows = read_csv(ur5 / "targets.csv")
    angles = np.linalg.solve(mixed, np.degrees(rows[:, 1:]).T - np.array([[0, -90, 90, 0, 0, 0]]).T).T
    foreign = write_csv(ur5 / "motors.csv", ["pose", *motors], np.column_stack([rows[:, 0], angles]))
    assert run("compensate", mapped, foreign, "--out", ur5 / "there.csv").status == 0
    assert run("compensate", plain, ur5 / "targets.csv", "--out", ur5 / "here.csv").status == 0
    there, here = pl.read_csv(ur5 / "there.csv"), pl.read_csv(ur5 / "here.csv").select(Q).to_numpy()
    assert there.columns[:7] == ["pose", *motors] and not set(Q) & set(there.columns)
    read = there.select(motors).to_numpy() @ mixed.T + [0, -90, 90, 0, 0, 0]
    np.testing.assert_allclose(np.radians(read), here, atol=1e-9)
