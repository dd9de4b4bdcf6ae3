"""`flexcal calibrate` and `flexcal verify` on the real UR5, and on altered copies of its data."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from cli_files import FLEXCAL, read_csv, snapshot, write_csv

from flexcal.data import read_estimates


@pytest.fixture
def some(ur5_folder: Path) -> Path:
    """150 poses spread over the grid, enough to fit the kinematics quickly."""
    header, rows = read_csv(ur5_folder / "grid.csv")
    return write_csv(ur5_folder / "some.csv", header, rows[::7][:140])


def test_whole_example_reaches_its_numbers(run, ur5_folder: Path) -> None:
    robot = ur5_folder / "robot.yaml"
    found = run("calibrate", robot, ur5_folder / "grid.csv", "--json")
    assert found.status == 0
    document = found.document
    assert document["identifiability"]["parameters"] == 45 and document["identifiability"]["rank"] == 25
    assert len(document["identifiability"]["dropped"]) == 20
    assert document["terms"][0] == "kinematic" and len(document["terms"]) > 1
    assert document["calibration"]["rigid"]["poses"] == 1000
    assert document["calibration"]["selected"]["mean_mm"] < document["calibration"]["rigid"]["mean_mm"] < 0.11
    quantity = document["parameters"]["shoulder_lift_joint.offset"]
    assert set(quantity) == {"estimate", "std", "low", "high", "truth", "identifiable"}
    assert quantity["identifiable"] and quantity["low"] < quantity["estimate"] < quantity["high"]
    lost = document["parameters"]["tool.offset"]
    assert not lost["identifiable"] and lost["std"] is lost["low"] is lost["high"] is None
    checked = run("verify", robot, ur5_folder / "random.csv", "--json").document
    assert checked["verification"]["measured"]["poses"] == 20
    assert checked["verification"]["measured"]["mean_mm"] < 0.092


def test_rigid_fit_reaches_the_published_accuracy(run, ur5_folder: Path) -> None:
    robot = ur5_folder / "robot.yaml"
    run("calibrate", robot, ur5_folder / "grid.csv", "--terms", "kinematic")
    measured = run("verify", robot, ur5_folder / "random.csv", "--json").document["verification"]["measured"]
    assert measured["mean_mm"] <= 0.101 + 5e-4
    assert measured["p90_mm"] <= 0.131 + 5e-4
    assert measured["max_mm"] <= 0.159 + 5e-4


def test_json_is_all_of_standard_output(ur5_folder: Path, some: Path) -> None:
    command = [FLEXCAL, "calibrate", ur5_folder / "robot.yaml", some, "--terms", "kinematic", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["terms"] == ["kinematic"]
    assert "next: flexcal verify" in done.stderr


def test_text_names_what_could_not_be_told_apart(run, ur5_folder: Path, some: Path) -> None:
    page = run("calibrate", ur5_folder / "robot.yaml", some, "--terms", "kinematic")
    assert page.status == 0
    assert "25 of 45 parameters" in page.out
    assert "wrist_3_joint.offset" in page.out and "the measurements do not depend on it" in page.out
    assert "weakest combinations" in page.out
    assert "next: flexcal verify" in page.out


def test_running_twice_gives_the_same_bytes(run, ur5_folder: Path, some: Path) -> None:
    arguments = ("calibrate", ur5_folder / "robot.yaml", some, "--terms", "kinematic")
    run(*arguments)
    first = snapshot(ur5_folder)
    run(*arguments)
    assert snapshot(ur5_folder) == first
    assert "estimates.yaml" in first and "estimates.npz" in first


def test_out_leaves_the_robots_folder_alone(run, ur5_folder: Path, some: Path, tmp_path: Path) -> None:
    before = snapshot(ur5_folder)
    robot, out = ur5_folder / "robot.yaml", tmp_path / "out"
    found = run("calibrate", robot, some, "--terms", "kinematic", "--out", out, "--json")
    assert snapshot(ur5_folder) == before
    assert sorted(p.name for p in out.iterdir()) == [
        "estimates.npz",
        "estimates.yaml",
        "report.html",
        "results.json",
    ]
    assert json.loads((out / "results.json").read_text()) == found.document
    checked = run(
        "verify", robot, ur5_folder / "random.csv", "--estimates", out, "--out", out / "check", "--json"
    )
    assert checked.document["verification"]["measured"]["mean_mm"] < 0.2
    assert json.loads((out / "check" / "results.json").read_text()) == checked.document


def test_provenance_names_inputs_and_options(run, ur5_folder: Path, some: Path) -> None:
    run("calibrate", ur5_folder / "robot.yaml", some, "--terms", "kinematic", "--loss", "huber")
    origin = read_estimates(ur5_folder / "estimates.yaml")["calibration"].provenance
    assert origin["option.loss"] == "huber" and origin["option.terms"] == "kinematic"
    assert origin["program"].startswith("flexcal ")
    assert {key.removeprefix("input.") for key in origin if key.startswith("input.")} == {
        "robot.yaml",
        "ur5.urdf",
        "some.csv",
    }


def test_instrument_may_stand_anywhere(run, ur5_folder: Path, some: Path) -> None:
    """The stored calibration has the place of the instrument: what it found must not depend on the measuring frame."""
    robot = ur5_folder / "robot.yaml"
    run("calibrate", robot, some, "--terms", "kinematic")
    reference = run("verify", robot, ur5_folder / "random.csv", "--json").document["verification"]["measured"]
    axis = np.array([0.4, -0.7, 0.6]) / np.linalg.norm([0.4, -0.7, 0.6])
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.eye(3) + np.sin(2.0) * skew + (1 - np.cos(2.0)) * skew @ skew
    for name in ("some.csv", "random.csv"):
        header, rows = read_csv(ur5_folder / name)
        at = [header.index(key) for key in "xyz"]
        rows[:, at] = rows[:, at] @ turn.T + [1.0, -2.0, 0.5]
        write_csv(ur5_folder / name, header, rows)
    run("calibrate", robot, some, "--terms", "kinematic")
    moved = run("verify", robot, ur5_folder / "random.csv", "--json").document["verification"]["measured"]
    assert moved["mean_mm"] == pytest.approx(reference["mean_mm"], rel=2e-3)


def test_outliers_are_found_and_listed(run, ur5_folder: Path, some: Path, rng: np.random.Generator) -> None:
    header, rows = read_csv(some)
    moved = rng.choice(len(rows), len(rows) // 10, replace=False)
    direction = rng.standard_normal((len(moved), 3))
    at = [header.index(key) for key in "xyz"]
    rows[np.ix_(moved, at)] += 5e-3 * direction / np.linalg.norm(direction, axis=1)[:, None]
    write_csv(some, header, rows)
    arguments = ("calibrate", ur5_folder / "robot.yaml", some, "--terms", "kinematic", "--loss", "cauchy")
    found = run(*arguments, "--json").document
    listed = {entry["pose"] for entry in found["outliers"]}
    assert listed >= set(rows[moved, 0].astype(int))
    assert len(listed) <= len(moved) + 2
    assert max(entry["error_mm"] for entry in found["outliers"]) == pytest.approx(5, abs=0.5)
    assert f"{len(listed)} outliers: pose " in run(*arguments).out
    measured = run("verify", ur5_folder / "robot.yaml", ur5_folder / "random.csv", "--json").document
    assert measured["verification"]["measured"]["mean_mm"] < 0.14


def test_intervals_follow_the_scatter_where_no_sigma_is_given(run, ur5_folder: Path, some: Path) -> None:
    header, rows = read_csv(some)
    robot = ur5_folder / "robot.yaml"
    scatter = run("calibrate", robot, some, "--terms", "kinematic", "--json").document
    assert not scatter["fit"]["sigma_given"] and scatter["fit"]["reduced_chi2"] == pytest.approx(1, abs=0.05)
    sigma = np.full((len(rows), 1), scatter["fit"]["sigma_mm"] * 1e-3)
    given = write_csv(ur5_folder / "given.csv", [*header, "sigma"], np.hstack([rows, sigma]))
    stated = run("calibrate", robot, given, "--terms", "kinematic", "--json").document
    assert stated["fit"]["sigma_given"]
    name = "elbow_joint.length_x"
    assert stated["parameters"][name]["std"] == pytest.approx(scatter["parameters"][name]["std"], rel=1e-3)


def test_terms_of_robot_yaml_are_kept(run, ur5_folder: Path, some: Path) -> None:
    robot = ur5_folder / "robot.yaml"
    robot.write_text(
        robot.read_text().replace("terms: auto", "terms: [kinematic, gravity_compliance, transmission]")
    )
    found = run("calibrate", robot, some, "--json").document
    orders = [f"transmission_{k}" for k in (1, 2, 3)]
    assert found["terms"] == ["kinematic", "gravity_compliance", *orders]
    assert "elbow_joint.gravity_compliance" in found["parameters"] and found["term_selection"] == []


def test_several_files_are_one_set(run, ur5_folder: Path, some: Path) -> None:
    header, rows = read_csv(some)
    halves = [write_csv(ur5_folder / f"half{k}.csv", header, rows[k::2]) for k in (0, 1)]
    found = run("calibrate", ur5_folder / "robot.yaml", *halves, "--terms", "kinematic", "--json").document
    assert found["calibration"]["rigid"]["poses"] == len(rows)
