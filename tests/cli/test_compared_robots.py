"""Last year's calibration and that after a crash, from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm, postures, tracked, write_poses, write_robot

from flexcal.jobs.pages import folder_comparison


@pytest.fixture
def cell(run, tmp_path: Path):
    """A function that calibrates an arm with the tracker elsewhere, into a folder of the cell."""
    robot = write_robot(tmp_path)
    rng = np.random.default_rng(3)

    def calibrated(name: str, arm: DHArm, centre: float = 0.0) -> Path:
        q = postures(rng, 45) + centre * np.eye(6)[0]
        file = write_poses(tmp_path / f"{name}.csv", q, tracked(arm.points(q), rng, 2e-5), 2e-5)
        assert run("calibrate", robot, file, "--out", tmp_path / "runs" / name).status == 0
        return tmp_path / "runs" / name

    return calibrated


def test_a_crash_is_told_from_a_tracker_that_stands_elsewhere(run, cell, tmp_path: Path) -> None:
    arm = DHArm.made(3)
    first, again, crashed = cell("first", arm), cell("again", arm), cell("crashed", arm.turned(3, 3e-4))
    done = run("report", first, "--compare", again)
    assert done.status == 0 and "the robot: no change beyond chance (p = " in done.out
    done = run("report", first, "--compare", crashed)
    assert "the robot: changed (p < 1e-6): joint_3.offset by +0." in done.out
    page = (first / "comparison.html").read_text("utf-8")
    assert "joint_3.offset" in page and "Change of the robot" in page and "changed (p &lt; 1e-6)" in page
    document = run("report", first, "--compare", crashed, "--json").document["geometry"]
    (item,) = document["explanations"]
    assert item["parameters"]["joint_3.offset"] == pytest.approx(3e-4, abs=5e-5)
    assert 0.05 < document["displacement_mm"]["p90_mm"] < 0.3
    found = folder_comparison(first, crashed)
    assert found.points.shape == found.displacement.shape == (200, 3) and found.std.shape == (200,)

    # the point declared elsewhere for the later calibration is no change
    robot = tmp_path / "robot.yaml"
    robot.write_text(robot.read_text().replace("0.11]", "0.114]"))
    declared = cell("declared", arm)
    done = run("report", first, "--compare", declared)
    assert "no change beyond chance" in done.out
    document = run("report", declared, "--compare", crashed, "--json").document["geometry"]
    assert [item["subject"] for item in document["explanations"]] == ["joint_3.offset"]


def test_where_the_robots_cannot_be_compared_it_is_said(run, cell, tmp_path: Path) -> None:
    arm = DHArm.made(4)
    first, second = cell("first", arm), cell("second", arm, centre=5.0)
    assert "joint_1 in ranges that hardly overlap" in run("report", first, "--compare", second).out
    other = cell("other", arm)
    robot = tmp_path / "robot.yaml"
    (tmp_path / "elsewhere").mkdir()
    moved = robot.rename(tmp_path / "elsewhere" / "cell.yaml")
    (tmp_path / "robot.urdf").rename(tmp_path / "elsewhere" / "robot.urdf")
    assert "give it with --robot" in run("report", first, "--compare", other).out
    assert "no change" in run("report", first, "--compare", other, "--robot", moved).out
    urdf = tmp_path / "elsewhere" / "robot.urdf"
    urdf.write_text(urdf.read_text().replace("effort", "effort "))
    done = run("report", first, "--compare", other, "--robot", moved)
    assert done.status == 0 and "is not the URDF of these calibrations" in done.out
    results = json.loads((other / "results.json").read_text())
    assert results["kind"] == "calibration"
