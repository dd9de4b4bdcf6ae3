"""What "before" says of arms of another simulator whose reflector is 6 mm from where robot.yaml has it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
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
