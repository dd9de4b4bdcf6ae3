"""`design poses`, `measure` of poses, `calibrate` of an elastic robot, and `export urdf`."""

from __future__ import annotations

import io
import json
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pytest
from cli_files import copied

from flexcal.calibration.kinds import rigid_motion
from flexcal.cli.main import main
from flexcal.data.plans import PosePlan, read_plan_of
from flexcal.files.formats import read_estimates
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel


@pytest.fixture(scope="module")
def once_measured(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The TX90L's folder with 45 designed poses, measured in the virtual cell, and 30 random ones."""
    folder = copied(examples / "tx90l", tmp_path_factory.mktemp("measured") / "tx90l")
    robot = folder / "robot.yaml"
    for name, options, verb in (
        ("chosen", ("--count", "45", "--candidates", "600"), "calibrate"),
        ("random", ("--count", "30", "--random"), "verify"),
    ):
        plan = folder / f"{name}.yaml"
        assert main(["design", "poses", str(robot), *options, "--out", str(plan)]) == 0
        measure = ["measure", str(plan), "--cell", "virtual", "--seed", "3", "--out", str(folder / name)]
        with redirect_stdout(io.StringIO()) as said:
            assert main(measure) == 0
        poses = folder / name / "poses.csv"
        assert said.getvalue().splitlines()[-1] == f"next: flexcal {verb} {robot} {poses}"
    return folder


@pytest.fixture
def measured(once_measured: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return copied(once_measured, tmp_path / "tx90l")


def test_chosen_poses_say_why(run, tx90l_folder: Path) -> None:
    out = tx90l_folder / "plan.yaml"
    arguments = (
        "design",
        "poses",
        tx90l_folder / "robot.yaml",
        "--count",
        30,
        "--candidates",
        400,
        "--out",
        out,
    )
    document = run(*arguments, "--json").document
    assert len(read_plan_of(out, PosePlan)) == document["poses"] == 30
    assert document["identifiability"]["rank"] == 29 and document["identifiability"]["parameters"] == 47
    assert 0 < document["tool_error_mm"] < 0.1
    assert all(side > 0 for sides in document["flanks"].values() for side in sides.values())
    counts = [entry["poses"] for entry in document["curve"]]
    assert counts == sorted(counts) and document["enough_poses"] in counts
    before = out.read_bytes()
    assert "29 of 47 parameters" in run(*arguments).out
    assert out.read_bytes() == before


def test_elastic_robot_end_to_end(run, measured: Path) -> None:
    robot = measured / "robot.yaml"
    found = run("calibrate", robot, measured / "chosen" / "poses.csv", "--json").document
    assert (found["identifiability"]["rank"], found["identifiability"]["parameters"]) == (29, 47)
    assert found["fit"]["sigma_given"]
    assert found["calibration"]["selected"]["mean_mm"] < 0.1 < found["calibration"]["rigid"]["mean_mm"]
    assert "joint_1.drive.stiffness" in found["parameters"] and "joint_2.backlash" in found["parameters"]
    checked = run("verify", robot, measured / "random" / "poses.csv", "--json").document
    assert checked["verification"]["measured"]["mean_mm"] < 0.1
    assert checked["verification"]["nominal"]["mean_mm"] > 0.5


def test_both_ways_of_using_the_prior_agree(run, measured: Path) -> None:
    poses, robot = measured / "chosen" / "poses.csv", measured / "robot.yaml"
    ways = {}
    for way in ("reestimated", "marginalised"):
        arguments = ("calibrate", robot, poses, "--elasticity", way, "--out", measured / way, "--json")
        ways[way] = run(*arguments).document["parameters"]["joint_3.length_x"]
    apart = ways["reestimated"]["estimate"] - ways["marginalised"]["estimate"]
    assert abs(apart) < 0.5 * ways["reestimated"]["std"]


def test_calibration_ignores_its_own_block(run, measured: Path) -> None:
    """Running twice, and on other poses in between, gives the same answer: a verb starts from nominal and the other blocks."""
    robot, poses = measured / "robot.yaml", measured / "chosen" / "poses.csv"
    run("calibrate", robot, poses)
    first = read_estimates(measured / "estimates.yaml")["calibration"]
    run("calibrate", robot, poses, measured / "random" / "poses.csv")
    run("calibrate", robot, poses)
    second = read_estimates(measured / "estimates.yaml")["calibration"]
    assert first.values == second.values
    assert np.array_equal(first.covariance, second.covariance)


def test_results_file_is_the_document(run, measured: Path) -> None:
    assert json.loads((measured / "chosen" / "results.json").read_text())["poses"] == 45


def test_exported_urdf_is_the_calibrated_robot(run, ur5_folder: Path) -> None:
    robot, out = ur5_folder / "robot.yaml", ur5_folder / "calibrated.urdf"
    nominal = run("export", "urdf", robot, "--out", out, "--json").document
    assert not nominal["calibrated"]
    run("calibrate", robot, ur5_folder / "grid.csv", "--terms", "kinematic")
    document = run("export", "urdf", robot, "--out", out, "--json").document
    assert document["calibrated"] and document["lost"] == [] and document["tool_error"]["max_mm"] < 1e-9
    model = RobotModel.from_yaml(robot)
    again = ur5_folder / "again.yaml"
    again.write_text(
        "robot: calibrated.urdf\npoints:\n  smr: {frame: smr, xyz: [0, 0, 0]}\nestimates: none.yaml\n"
    )
    q = np.random.default_rng(3).uniform(-3, 3, (50, 6))
    there = point_kinematics(RobotModel.from_yaml(again), q, jacobians=False).position
    here = point_kinematics(model, q, jacobians=False).position
    # where the base stands before a tracker with a frame of its own is a choice: the most probable robot's here
    turn, shift = rigid_motion(here, there)
    assert np.abs(there - here @ turn.T - shift).max() < 1e-9 and np.linalg.norm(shift) < 5e-3
    assert (
        np.abs(
            here - point_kinematics(RobotModel.from_yaml(robot, estimates=False), q, jacobians=False).position
        ).max()
        > 1e-4
    )


def test_export_says_what_is_lost_in_millimetres(run, tx90l_folder: Path) -> None:
    page = run("export", "urdf", tx90l_folder / "robot.yaml", "--out", tx90l_folder / "new.urdf")
    assert page.status == 0 and "elastic deflection" in page.out and " mm on average" in page.out
    assert "the joint placements are nominal" in page.out and page.out.splitlines()[-1].startswith(
        "next: flexcal calibrate"
    )
