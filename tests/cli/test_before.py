"""What "before" says of arms of another simulator whose reflector is 6 mm from where robot.yaml has it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from refusals import refused
from stranger_arm import SIX, StrangerArm

BLOCKS = ("declared", "registered", "own")


def calibrated(run, folder: Path, arm: StrangerArm, poses: int = 60, *arguments: str):
    """The document of calibrate, and the joint positions."""
    robot, rng = arm.write(folder), np.random.default_rng(arm.seed + 100)
    q = arm.postures(poses, rng)
    file = arm.write_poses(folder / "poses.csv", q, arm.measured(q, rng))
    done = run("calibrate", robot, file, *arguments, "--json")
    assert done.status == 0, done.err
    return done.document, q


@pytest.mark.parametrize("axes", [None, SIX], ids=["seven", "six"])
def test_the_rulers_error_is_not_the_robots(run, tmp_path: Path, axes) -> None:
    arm = StrangerArm(seed=1) if axes is None else StrangerArm(seed=1, axes=tuple(axes))
    document, q = calibrated(run, tmp_path, arm)
    before, truth = document["before"], 1e3 * arm.own_error(q)
    assert before["declared"] is None  # the tracker's frame is its own
    assert before["own"]["mean_mm"] == pytest.approx(truth.mean(), rel=0.02)
    assert before["own"]["p90_mm"] == pytest.approx(np.quantile(truth, 0.9), rel=0.03)
    assert before["own"]["max_mm"] == pytest.approx(truth.max(), rel=0.03)
    assert before["registered"]["mean_mm"] > 1.5 * before["own"]["mean_mm"]
    assert document["calibration"]["nominal"] == before["registered"]
    assert before["own"]["poses"] == 60


def test_in_the_base_frame_the_declared_error_holds_the_ruler(run, tmp_path: Path) -> None:
    arm = StrangerArm(seed=2, tracker_at_base=True)
    document, q = calibrated(run, tmp_path, arm)
    nominal = (arm.tool(q, true=False) @ np.append(arm.declared_xyz, 1.0))[:, :3]
    real = (arm.tool(q, true=True) @ np.append(arm.true_xyz, 1.0))[:, :3]
    declared = 1e3 * np.linalg.norm(real - nominal, axis=1)
    before = document["before"]
    assert before["declared"]["mean_mm"] == pytest.approx(declared.mean(), rel=0.01)
    assert before["own"]["mean_mm"] == pytest.approx(1e3 * arm.own_error(q).mean(), rel=0.02)
    assert before["declared"]["mean_mm"] >= before["registered"]["mean_mm"] >= before["own"]["mean_mm"]


def test_at_a_declared_station_parallel_to_the_base(run, tmp_path: Path) -> None:
    arm = StrangerArm(seed=3, tracker_at_base=True)
    arm.tracker = np.block(
        [[np.eye(3), -np.array([[2.5], [-0.4], [1.1]])], [np.zeros((1, 3)), np.ones((1, 1))]]
    )
    robot, rng = (
        arm.write(tmp_path, "stations: {tracker: {xyz: [2.5, -0.4, 1.1]}}\n"),
        np.random.default_rng(5),
    )
    q = arm.postures(40, rng)
    file = arm.write_poses(tmp_path / "poses.csv", q, arm.measured(q, rng))
    before = run("calibrate", robot, file, "--json").document["before"]
    assert before["declared"]["mean_mm"] == pytest.approx(6, rel=0.5)


def test_folder_console_and_verification_have_all_three(run, tmp_path: Path) -> None:
    arm = StrangerArm(seed=4)
    document, _ = calibrated(run, tmp_path, arm, 60, "--out", str(tmp_path / "fit"))
    assert json.loads((tmp_path / "fit" / "results.json").read_text())["before"] == document["before"]
    points = pl.read_csv(tmp_path / "fit" / "points.csv")
    own = np.linalg.norm(points.select("own_dx", "own_dy", "own_dz").to_numpy(), axis=1)
    assert 1e3 * own.mean() == pytest.approx(document["before"]["own"]["mean_mm"])
    assert "declared_dx" not in points.columns and "nominal_dx" in points.columns
    html = (tmp_path / "fit" / "report.html").read_text(encoding="utf-8")
    for words in ("before, as declared", "before, best-fit registered", "own (registered, point found too)"):
        assert words in html
    rng = np.random.default_rng(9)
    q = arm.postures(30, rng)
    fresh = arm.write_poses(tmp_path / "fresh.csv", q, arm.measured(q, rng))
    robot = tmp_path / "robot.yaml"
    done = run("verify", robot, fresh, "--estimates", tmp_path / "fit", "--out", tmp_path / "check")
    assert done.status == 0 and "the robot's own: point found too" in done.out
    checked = json.loads((tmp_path / "check" / "results.json").read_text())
    assert checked["before"]["own"]["mean_mm"] == pytest.approx(1e3 * arm.own_error(q).mean(), rel=0.02)
    assert checked["verification"]["nominal"] == checked["before"]["registered"]
    few = arm.write_poses(tmp_path / "few.csv", q[:6], arm.measured(q[:6], rng))
    before = run("verify", robot, few, "--estimates", tmp_path / "fit", "--json").document["before"]
    assert before["own"] is None and before["registered"]["poses"] == 6


def test_the_found_point_is_said_and_written(run, tmp_path: Path) -> None:
    arm = StrangerArm(seed=5)
    robot, rng = arm.write(tmp_path, "# the end\n"), np.random.default_rng(6)
    q = arm.postures(60, rng)
    file = arm.write_poses(tmp_path / "poses.csv", q, arm.measured(q, rng))
    text = robot.read_text()
    done = run("calibrate", robot, file)
    assert "calibrated position of the point smr: [0.05" in done.out and "--write-point writes it" in done.out
    assert robot.read_text() == text
    before = run("verify", robot, file, "--json").document["verification"]["measured"]
    done = run("calibrate", robot, file, "--write-point", "--json")
    found = json.loads(done.out)["points"]["smr"]
    assert np.linalg.norm(np.subtract(found["found_xyz_m"], found["declared_xyz_m"])) < 1e-4
    declared = np.array(found["declared_xyz_m"])
    assert (
        np.linalg.norm((declared - arm.true_xyz)[:2]) < 4e-4
    )  # along the last axis nothing tells it from the flange
    changed = robot.read_text()
    assert (
        "# the reflector, with a ruler" in changed
        and "# by hand" in changed
        and changed.endswith("# the end\n")
    )
    assert [a for a, b in zip(text.split("\n"), changed.split("\n"), strict=True) if a != b] == [
        text.split("\n")[3]
    ]
    after = run("verify", robot, file, "--json").document["verification"]["measured"]
    assert after["mean_mm"] == pytest.approx(before["mean_mm"], rel=0.01)


def test_import_offers_the_place_of_the_point(run, tmp_path: Path) -> None:
    arm = StrangerArm(seed=6)
    robot, rng = arm.write(tmp_path), np.random.default_rng(6)
    q = arm.postures(60, rng)
    file = arm.write_poses(tmp_path / "poses.csv", q, arm.measured(q, rng), None)
    done = run("import", robot, file, "--out", tmp_path / "in.csv", "--sigma", "0.02")
    assert "--write-point writes this there" in done.out
    done = run("import", robot, file, "--out", tmp_path / "in.csv", "--sigma", "0.02", "--write-point")
    assert done.status == 0 and "wrote the xyz of smr" in done.out and "# by hand" in robot.read_text()
    before = run("calibrate", robot, tmp_path / "in.csv", "--json").document["before"]
    assert before["registered"]["mean_mm"] < 1.3 * before["own"]["mean_mm"]


def test_points_in_blocks_and_in_quotes(tmp_path: Path) -> None:
    from flexcal.jobs.setup import write_point_position

    robot = StrangerArm().write(tmp_path)
    robot.write_text(
        'robot: arm.urdf\npoints:\n  a: {frame: tool0, xyz: [1, 2, 3]}  # a: xyz: [9, 9, 9]\n  "b":\n    frame: tool0  # xyz: [0, 0, 0]\n'
        "    xyz: [0.1, 0.2,\n          0.3]\ngravity: [0, 0, -9.81]\n"
    )
    write_point_position(robot, "b", np.array([0.5, 0.25, -0.125]))
    assert (
        "xyz: [0.500000, 0.250000, -0.125000]\ngravity" in robot.read_text()
        and "[1, 2, 3]" in robot.read_text()
    )
    write_point_position(robot, "a", np.array([0.5, 0.25, -0.125]))
    assert (
        "  a: {frame: tool0, xyz: [0.500000, 0.250000, -0.125000]}  # a: xyz: [9, 9, 9]" in robot.read_text()
    )
    robot.write_text(
        "robot: arm.urdf\npoints:\n  a:\n    frame: tool0\n    xyz:\n      - 1\n      - 2  # down\n      - 3\n"
    )
    write_point_position(robot, "a", np.zeros(3))
    assert "- 0.000000\n      - 0.000000  # down\n      - 0.000000\n" in robot.read_text()
    text = "robot: arm.urdf\npoints:\n  a: {frame: tool0, xyz: &p [1, 2, 3]}\n  b: {frame: tool0, xyz: *p}\n"
    robot.write_text(text)
    with refused("E-RUN-090"):
        write_point_position(robot, "a", np.zeros(3))
    assert robot.read_text() == text


def test_a_tool_that_never_turns_does_not_tell_where_its_point_is(run, tmp_path: Path) -> None:
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    arm = StrangerArm(seed=1, axes=tuple(SIX))
    robot, rng = arm.write(tmp_path), np.random.default_rng(51)
    still, q = Rotation.from_euler("y", 2.2).as_matrix(), []
    while len(q) < 30:
        place = rng.uniform([0.4, -0.4, 0.3], [0.9, 0.4, 1.0])

        def away(row: np.ndarray, place: np.ndarray = place) -> np.ndarray:
            at = arm.tool(row, true=False)[0]
            return np.r_[at[:3, 3] - place, Rotation.from_matrix(still.T @ at[:3, :3]).as_rotvec()]

        found = least_squares(away, arm.postures(1, rng, 0.3)[0])
        if found.cost < 1e-12 and np.abs(found.x).max() < 3:
            q.append(found.x)
    q = np.array(q)
    file = arm.write_poses(tmp_path / "poses.csv", q, arm.measured(q, rng))
    text = robot.read_text()
    done = run("calibrate", robot, file, "--write-point")
    assert done.status == 0 and robot.read_text() == text
    # either it is said that the place is not told, or it was held near where it was declared
    point = run("calibrate", robot, file, "--json").document["points"]["smr"]
    moved = np.linalg.norm(np.subtract(point["found_xyz_m"], point["declared_xyz_m"]))
    assert "calibrated position of the point" not in done.out or moved < 0.015
    assert (
        point["std_m"] > 0.002 and "do not determine the position of the point smr" in done.out
    ) or moved < 0.015
