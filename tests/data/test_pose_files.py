"""Measured poses: every fault in one sentence with file, line and column; poses come back as they were written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from flexcal.data.poses import (
    PoseSet,
    concatenate,
    read_grouped_poses,
    read_pose_pool,
    read_poses,
    write_poses,
)
from flexcal.data.tables import tabular_file
from flexcal.model.robot import RobotModel
from flexcal.units import DEGREE, MILLIMETRE

HEADER = "pose,q1,q2,x,y,z"
GOOD = ["1,0.1,0.2,0.5,0.1,0.9", "2,-0.7,1.2,0.4,-0.3,0.8", "3,0.6,-0.4,0.2,0.2,1.0"]


def file(path: Path, lines: list[str], header: str = HEADER) -> Path:
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def make_poses(rows: int = 5, seed: int = 1, **changes: Any) -> PoseSet:
    rng = np.random.default_rng(seed)
    quaternion = rng.normal(size=(rows, 4))
    values: dict[str, Any] = {
        "q": rng.uniform(-2, 2, (rows, 2)),
        "position": rng.uniform(-1, 1, (rows, 3)),
        "sigma": rng.uniform(1e-5, 1e-4, (rows, 3)),
        "torque": rng.normal(0, 100, (rows, 2)),
        "payload": rng.uniform(0, 6, rows),
        "target": np.array(["smr", "ball"] * rows)[:rows],
        "station": np.array(["north", "1", "1"] * rows)[:rows],
        "temperature": rng.uniform(15, 30, rows),
        "time": 30.0 * np.arange(rows),
        "pose": np.arange(rows),
        "quaternion_wxyz": quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True),
    }
    return PoseSet(**(values | changes))


def same(one: PoseSet, other: PoseSet) -> None:
    for name, value in vars(one).items():
        if isinstance(value, np.ndarray):
            assert np.array_equal(value, getattr(other, name), equal_nan=name == "position"), name
        else:
            assert value == getattr(other, name), name


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_round_trip(tmp_path: Path, robot: Any, ending: str) -> None:
    path = tmp_path / f"poses.{ending}"
    poses = make_poses()
    write_poses(path, poses)
    again = read_poses(path, robot)
    assert again.quaternion_wxyz is not None
    assert poses.quaternion_wxyz is not None
    assert np.allclose(again.quaternion_wxyz, poses.quaternion_wxyz, rtol=0, atol=1e-15)
    same(make_poses(quaternion_wxyz=again.quaternion_wxyz), again)
    assert again.pose.dtype == np.int64
    assert again.target.dtype.kind == "U"


@settings(max_examples=50, deadline=None)
@given(st.integers(1, 20), st.integers(0, 1000), st.booleans(), st.booleans(), st.booleans())
def test_optional_columns_round_trip(
    any_robot: Any,
    tmp_path_factory: pytest.TempPathFactory,
    rows: int,
    seed: int,
    wire: bool,
    sigma: bool,
    torque: bool,
) -> None:
    changes: dict[str, Any] = {"quaternion_wxyz": None, "sigma_given": sigma}
    rng = np.random.default_rng(seed)
    if wire:
        changes |= {"position": np.column_stack([rng.uniform(0.1, 2, rows), np.zeros((rows, 2))])}
        changes |= {"kind": np.full(rows, "distance"), "station": np.full(rows, "rope")}
        changes["sigma"] = np.repeat(rng.uniform(1e-5, 1e-4, (rows, 1)), 3, axis=1)
    if not sigma:
        changes["sigma"] = np.full((rows, 3), 1e-4)
    if not torque:
        changes |= {"torque": None, "payload": None, "temperature": None, "time": None}
    poses = make_poses(rows, seed, **changes)
    path = tmp_path_factory.getbasetemp() / "any.csv"
    write_poses(path, poses)
    with pytest.MonkeyPatch.context() as patched:  # the robot has no kinematics
        patched.setattr("flexcal.data.poses.checks._check_size", lambda *_: None)
        same(poses, read_poses(path, any_robot, require_motion=False))


def test_defaults(tmp_path: Path, robot: Any) -> None:
    poses = read_poses(file(tmp_path / "poses.csv", GOOD), robot)
    assert poses.stations == ("tracker",)
    assert poses.targets == ("smr",)
    assert (poses.sigma == 1e-4).all()
    assert not poses.sigma_given
    assert (
        poses.torque
        is poses.payload
        is poses.temperature
        is poses.time
        is poses.quaternion_wxyz
        is poses.kind
        is None
    )
    assert poses.pose.tolist() == [1, 2, 3]
    sigma = read_poses(file(tmp_path / "s.csv", [line + ",2e-5" for line in GOOD], HEADER + ",sigma"), robot)
    assert sigma.sigma.tolist() == [[2e-5] * 3] * 3


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_columns_of_texts_are_left_out_and_said(tmp_path: Path, robot: RobotModel, suffix: str) -> None:
    lines = [f"{line},{who},{what}" for line, who, what in zip(GOOD, "abc", ("", "again", ""), strict=False)]
    path = file(tmp_path / "notes.csv", lines, HEADER + ",operator,remark")
    if suffix == ".parquet":
        pl.read_csv(path).write_parquet(path := path.with_suffix(suffix))
    poses = read_poses(path, robot)
    assert len(poses) == len(lines)
    (note,) = poses.notes
    assert note == f"{path.name}: the texts in operator, remark are not used"
    with refused("E-POSES-074", "staton", "station"):
        read_poses(file(tmp_path / "near.csv", [f"{line},a" for line in GOOD], HEADER + ",staton"), robot)


def test_a_number_may_group_measurements(tmp_path: Path, robot: RobotModel) -> None:
    path = file(tmp_path / "p.csv", GOOD, HEADER)
    poses, labels = read_grouped_poses([path], robot, "pose")
    assert poses.pose.tolist() == [1, 2, 3] and labels.tolist() == ["1", "2", "3"]


@pytest.mark.parametrize(
    ("header", "lines", "refusal"),
    [
        ("pose,q1,q2,x,y", GOOD, ["E-TABLE-006", "line 1", "z"]),
        ("q1,q2,x,y,z", GOOD, ["E-TABLE-006", "line 1", "pose"]),
        ("pose,q1,q2", GOOD, ["E-POSES-020", "line 1"]),
        ("Nr,J1,J2,X,Y,Z", GOOD, ["E-POSES-019", "line 1", "q1 … q2"]),
        ("Nr;J1;J2;X;Y;Z", GOOD, ["E-TABLE-029", "1"]),
        (HEADER + ",colour", GOOD, ["E-TABLE-004", "line 1", "colour"]),
        (HEADER + ",sigm_x", GOOD, ["E-TABLE-004", "line 1", "sigm_x", "sigma_x"]),
        (HEADER + ",sigma_x", GOOD, ["E-TABLE-006", "line 1", "sigma_y"]),
        (HEADER + ",qw,qx,qy", GOOD, ["E-TABLE-006", "line 1", "qz"]),
        (HEADER + ",length", GOOD, ["E-POSES-057", "line 1"]),
        (HEADER + ",sigma,sigma_x,sigma_y,sigma_z", GOOD, ["E-POSES-017", "line 1"]),
        ("pose,q1,x,y,z", GOOD, ["E-TABLE-007", "line 1", "1", "q1…q1", "2"]),
        ("pose,q1,q2,q3,x,y,z", GOOD, ["E-TABLE-007", "line 1", "3", "q1…q3", "2"]),
        (HEADER + ",tau1", GOOD, ["E-TABLE-007", "line 1", "tau1…tau1", "2"]),
        (HEADER, [GOOD[0], "2,0.1,0.2,0.3,NaN,0.4"], ["E-TABLE-036", "3", "y", "NaN"]),
        (HEADER, [GOOD[0], "2,0.1,0.2,0.3,,0.4"], ["E-TABLE-036", "3", "y", "missing"]),
        (HEADER, [GOOD[0], "2,0.1,0.2,0.3"], ["E-TABLE-035", "3", "4", "6"]),
        (HEADER, [GOOD[0], "2.5,0.1,0.2,0.3,0,0.4"], ["E-POSES-012", "line 3, column pose"]),
        (HEADER, [GOOD[0], "B,0.1,0.2,0.3,0,0.4"], ["E-TABLE-036", "3", "pose", "'B' is not a number"]),
        (HEADER, [GOOD[0], "1,0.5,0.2,0.3,0,0.4"], ["E-POSES-006", "line 3, column q1", "pose 1", "line 2"]),
        (
            HEADER,
            [GOOD[0], "2,10,-90,0.3,0,0.4"],
            ["E-TABLE-001", "line 3, column q1", "base", "degrees", "unit: deg"],
        ),
        (
            HEADER,
            ["1,0,0.2,500,100,900", "2,1,0.1,400,-300,800"],
            ["E-POSES-007", "line 2, column z", "1.2", "millimetres", "unit: mm"],
        ),
        (
            HEADER,
            [*GOOD, *GOOD[:2], "9,0.1,0,0.2,70,0.1"],
            ["E-POSES-007", "line 7, column y", "correct or remove"],
        ),
        (HEADER, ["1,0.1,0.2,0.3,0,0.4"], ["E-POSES-003"]),
        (HEADER, ["1,0.1,0.2,0.3,0,0.4", "2,0.1,0.2,0.3,0,0.4"], ["E-POSES-004", "q1…q2"]),
        (
            HEADER,
            ["1,0.1,0.2,0.3,0,0.4", "2,0.1,0.9,0.5,0,0.4"],
            ["E-POSES-005", "joint never moves", "base (column q1)"],
        ),
        (
            HEADER + ",target",
            [GOOD[0] + ",smr", GOOD[1] + ",bal"],
            ["E-POSES-010", "line 3, column target", "bal", "ball"],
        ),
        (
            HEADER + ",target",
            [GOOD[0] + ",zzz"],
            ["E-POSES-010", "line 2, column target", "known are smr, ball"],
        ),
        (HEADER + ",target", [GOOD[0] + ","], ["E-TABLE-036", "2", "target", "missing"]),
        (
            HEADER + ",payload",
            [GOOD[0] + ",-1"],
            ["E-POSES-011", "line 2, column payload", "-1", "not negative"],
        ),
        (HEADER + ",sigma", [GOOD[0] + ",0"], ["E-POSES-011", "line 2, column sigma", "positive"]),
        (
            "pose,q1,q2,length",
            ["1,0,0,1", "2,0.1,0.1,-1"],
            ["E-POSES-011", "line 3, column length", "positive"],
        ),
        (
            "pose,q1,q2,length",
            ["1,0,0,900", "2,0.1,0.1,800"],
            ["E-POSES-007", "line 2, column length", "millimetres"],
        ),
        (
            HEADER + ",qw,qx,qy,qz",
            [GOOD[0] + ",1,0,0,0", GOOD[1] + ",1,1,0,0"],
            ["E-POSES-014", "line 3, column qw", "1.414"],
        ),
        (HEADER, [], ["E-TABLE-019", "line 1"]),
    ],
)
def test_sentences(tmp_path: Path, robot: Any, header: str, lines: list[str], refusal: list[str]) -> None:
    with refused(*refusal) as caught:
        read_poses(file(tmp_path / "poses.csv", lines, header), robot)
    assert str(caught.value).startswith(str(tmp_path / "poses.csv"))


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_too_many_rows_are_refused_before_they_are_read(
    tmp_path: Path, robot: Any, ending: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tabular_file, "MOST_ROWS", 3)
    poses = make_poses(3, payload=None, torque=None, target=np.full(3, "smr"), station=np.full(3, "1"))
    path = tmp_path / f"poses.{ending}"
    write_poses(path, poses)
    assert len(read_poses(path, robot)) == 3
    if ending == "csv":
        path.write_text(path.read_text() + 4 * "neither number nor pose\n")
    else:
        pl.concat([pl.read_parquet(path)] * 3).write_parquet(path)
    with refused("E-TABLE-045", str(path), "3", "keep one pose of 3"):
        read_poses(path, robot)


def test_robot_that_declares_too_little(tmp_path: Path, make_robot: Callable[..., Any]) -> None:
    path = file(tmp_path / "poses.csv", [line + ",2" for line in GOOD], HEADER + ",payload")
    with refused("E-POSES-009"):
        read_poses(path, make_robot(payload=None))
    with refused("E-POSES-008"):
        read_poses(file(path, GOOD), make_robot(points={}))


def test_motion_is_asked_for_only_where_it_is_needed(tmp_path: Path, robot: Any) -> None:
    path = file(tmp_path / "poses.csv", GOOD[:1])
    assert len(read_poses(path, robot, require_motion=False)) == 1
    path = file(tmp_path / "held.csv", ["1,0.1,0.2,0.3,0,0.4", "2,0.1,0.9,0.5,0,0.4"])
    assert len(read_poses(path, robot, require_motion=False)) == 2
    with refused("E-POSES-003"):
        read_poses([file(tmp_path / "a.csv", GOOD[:1])], robot)


def test_several_files_are_numbered_on(tmp_path: Path, robot: Any) -> None:
    one, two = file(tmp_path / "a.csv", GOOD), file(tmp_path / "b.csv", GOOD[1:])
    poses = read_poses([one, two], robot)
    assert poses.pose.tolist() == [1, 2, 3, 4, 5]
    assert poses.q[:, 0].tolist() == [0.1, -0.7, 0.6, -0.7, 0.6]


def test_signals(tmp_path: Path, make_robot: Callable[..., Any]) -> None:
    robot = make_robot("  q: {columns: [a, b], unit: deg}\n  xyz: {columns: [X, Y, Z], unit: mm}")
    lines = ["1,10,20,100,200,300", "2,30,50,110,210,310"]
    poses = read_poses(file(tmp_path / "poses.csv", lines, "pose,a,b,X,Y,Z"), robot)
    assert np.allclose(poses.q, np.array([[10, 20], [30, 50]]) * DEGREE)
    assert np.allclose(poses.position, np.array([[100, 200, 300], [110, 210, 310]]) * MILLIMETRE)
    standard = read_poses(file(tmp_path / "si.csv", GOOD), robot)
    assert standard.q[0].tolist() == [0.1, 0.2]


def test_units_are_checked_after_the_mapping(tmp_path: Path, make_robot: Callable[..., Any]) -> None:
    robot = make_robot("  q: {columns: [a, b]}")
    path = file(tmp_path / "poses.csv", ["1,1,2,0.1,0.2,0.3", "2,1,90,0.1,0.2,0.3"], "pose,a,b,x,y,z")
    with refused("E-TABLE-001", "line 3, column b"):
        read_poses(path, robot)


def test_prismatic_joint_in_millimetres(
    tmp_path: Path, make_robot: Callable[..., Any], make_joint: Callable[..., Any]
) -> None:
    robot = make_robot(
        joints=(make_joint("axis", -0.5, 0.5, "prismatic"), make_joint("elbow", -3.0, 3.0, "revolute"))
    )
    path = file(tmp_path / "poses.csv", ["1,300,0.1,0.1,0.2,0.3", "2,400,0.2,0.1,0.2,0.3"])
    with refused("E-TABLE-001", "line 2, column q1", "millimetres"):
        read_poses(path, robot)


def test_tracker_far_away_and_several_stations(tmp_path: Path, robot: Any) -> None:
    near = ["1,0.1,0.2,0.5,0.1,0.9,a", "2,-0.7,1.2,0.4,-0.3,0.8,a"]
    far = ["3,0.6,-0.4,15.2,20.2,1.0,b", "4,0.9,-0.1,15.3,20.1,0.9,b"]
    poses = read_poses(file(tmp_path / "poses.csv", near + far, HEADER + ",station"), robot)
    assert poses.stations == ("a", "b")


def test_ur5_measurements(examples: Path, ur5: RobotModel) -> None:
    poses = read_poses([examples / "ur5_tracker" / "grid.csv", examples / "ur5_tracker" / "random.csv"], ur5)
    assert len(poses) == 1020
    assert np.unique(poses.pose).size == 1020
    assert np.array_equal(poses.pose, np.arange(1020))


def test_subset_and_concatenate() -> None:
    poses = make_poses(6)
    same(
        concatenate([poses.subset(slice(0, 2)), poses.subset([2, 3, 4]), poses.subset(np.arange(6) == 5)]),
        poses,
    )
    assert len(poses.subset([])) == 0
    turned = poses.subset([4, 1])
    assert turned.pose.tolist() == [4, 1]
    assert np.array_equal(turned.q, poses.q[[4, 1]])
    assert concatenate([poses, poses]).pose.tolist() == list(range(12))
    with refused("E-POSES-026", "1", "2", "torque"):
        concatenate([poses, make_poses(6, torque=None)])
    with refused("E-POSES-024"):
        concatenate([poses, make_poses(6, q=np.zeros((6, 3)), torque=None)])
    with refused("E-POSES-023"):
        concatenate([])
    with refused("E-POSES-022", "payload"):
        make_poses(6, payload=np.zeros(3))
    with refused("E-POSES-021"):
        make_poses(6, q=np.zeros(3))


def test_not_finite_is_not_written(tmp_path: Path) -> None:
    poses = make_poses(3, position=np.full((3, 3), np.nan))
    with refused("E-POSES-016", "xyz", "1"):
        write_poses(tmp_path / "poses.csv", poses)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_pool_takes_every_pose_once(tmp_path: Path, robot: Any, ending: str) -> None:
    poses = make_poses(6, pose=np.array([4, 4, 9, 2, 2, 2]), payload=np.full(6, 2.5))
    poses.q[:] = poses.q[[0, 0, 2, 3, 3, 3]]
    write_poses(tmp_path / f"poses.{ending}", poses)
    pool = read_pose_pool(tmp_path / f"poses.{ending}", robot)
    assert pool.pose.tolist() == [4, 9, 2]
    np.testing.assert_array_equal(pool.q, poses.q[[0, 2, 3]])
    assert pool.payload == 2.5


def test_a_pool_needs_no_measurements(tmp_path: Path, robot: Any) -> None:
    pool = read_pose_pool(file(tmp_path / "taught.csv", ["1,0.1,0.2", "2,3,-3"], "pose,q1,q2"), robot)
    assert (pool.pose.tolist(), pool.q.tolist(), pool.payload) == ([1, 2], [[0.1, 0.2], [3, -3]], None)


@pytest.mark.parametrize(
    ("header", "lines", "refusal"),
    [
        ("pose,q1", GOOD, ["E-TABLE-007", "line 1", "2"]),
        ("q1,q2", GOOD, ["E-TABLE-006", "line 1", "pose"]),
        ("pose,q1,q2,colour", GOOD, ["E-TABLE-004", "line 1", "colour"]),
        ("pose,q1,q2", ["1,0,0", "7,0.1,-3.2"], ["E-TABLE-002", "line 3, column q2", "pose 7", "-3.2", "elbow", "-3 to 3"]),
        ("pose,q1,q2", ["1,0,0", "1,0.1,0.2"], ["E-POSES-006", "line 3, column q1"]),
        ("pose,q1,q2", ["1,0,0", "2,10,-90"], ["E-TABLE-001", "line 3, column q1", "degrees"]),
        ("pose,q1,q2,payload", ["1,0,0,2", "2,0,1,3"], ["E-POSES-015", "line 3, column payload", "3", "2"]),
        ("pose,q1,q2,payload", ["1,0,0,-2"], ["E-POSES-011", "line 2, column payload", "not negative"]),
    ],
)  # fmt: skip
def test_pools_that_do_not_fit(
    tmp_path: Path, robot: Any, header: str, lines: list[str], refusal: list[str]
) -> None:
    with refused(*refusal) as caught:
        read_pose_pool(file(tmp_path / "pool.csv", lines, header), robot)
    assert str(caught.value).startswith(str(tmp_path / "pool.csv"))
