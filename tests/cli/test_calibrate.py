"""`flexcal calibrate` and `flexcal verify` on the real UR5, and on altered copies of its data."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from cli_files import FLEXCAL, read_csv, snapshot, write_csv

from flexcal.calibration.diagnostics import Coupling, undeclared_coupling
from flexcal.calibration.fit import StratifiedSample
from flexcal.data.poses import PoseSet, write_poses
from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.files.formats import read_estimates, write_estimates
from flexcal.jobs.calibration import result
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium


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
    assert set(quantity) == {"estimate", "std", "low", "high", "truth", "identifiable", "bound"}
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
    assert measured["mean_mm"] <= 0.101
    assert measured["p90_mm"] <= 0.131
    assert measured["max_mm"] <= 0.159


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
    assert "least determined combinations" in page.out
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
        ".flexcal",
        "arm.npz",
        "estimates.npz",
        "estimates.yaml",
        "gravity_loads.npz",
        "points.csv",
        "report.html",
        "results.json",
    ]
    assert json.loads((out / "results.json").read_text()) == found.document
    assert found.document["verdict"]["trusted"] is None and "left_out" in found.document["verdict"]["reasons"]
    checked = run(
        "verify", robot, ur5_folder / "random.csv", "--estimates", out, "--out", out / "check", "--json"
    )
    assert checked.document["verification"]["measured"]["mean_mm"] < 0.2
    assert json.loads((out / "check" / "results.json").read_text()) == checked.document
    assert checked.document["verdict"] == {
        "trusted": True,
        "reasons": ["unseen_poses", "claimed_uncertainty"],
    }
    assert "Trusted: yes — because " in checked.err


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
    assert not scatter["fit"]["sigma_given"]
    assert scatter["fit"]["reduced_chi2"] is None and scatter["fit"]["stated_noise"] == []
    assert scatter["variances"]["instrument_mm"] is None and scatter["variances"]["robot_mm"] > 0.03
    sigma = np.full((len(rows), 1), scatter["variances"]["robot_mm"] * 1e-3)
    given = write_csv(ur5_folder / "given.csv", [*header, "sigma"], np.hstack([rows, sigma]))
    stated = run("calibrate", robot, given, "--terms", "kinematic", "--json").document
    assert stated["fit"]["sigma_given"]
    assert stated["variances"]["robot_mm"] < 0.5 * stated["variances"]["instrument_mm"]
    name = "shoulder_lift_joint.length_z"
    assert stated["parameters"][name]["std"] == pytest.approx(scatter["parameters"][name]["std"], rel=0.2)


def test_few_readings_tell_the_scatter_badly(run, ur5_folder: Path, some: Path) -> None:
    """13 poses have 39 coordinates, of which 25 parameters leave 14: √(1/28) = 19 %."""
    header, rows = read_csv(some)
    few = write_csv(ur5_folder / "few.csv", header, rows[::11])
    robot = ur5_folder / "robot.yaml"
    remarks = run("calibrate", robot, few, "--terms", "kinematic", "--prior", "none", "--json").document[
        "remarks"
    ]
    assert any(
        "leave 14 degrees of freedom beside the parameters" in text and "±19 %" in text for text in remarks
    )
    many = run("calibrate", robot, some, "--terms", "kinematic", "--json").document["remarks"]
    assert not any("degrees of freedom" in text for text in many)


def test_terms_of_robot_yaml_are_kept(run, ur5_folder: Path, some: Path) -> None:
    robot = ur5_folder / "robot.yaml"
    robot.write_text(
        robot.read_text().replace("terms: auto", "terms: [kinematic, gravity_compliance, transmission]")
    )
    found = run("calibrate", robot, some, "--json").document
    assert found["terms"] == ["kinematic", "gravity_compliance", "transmission"]
    assert found["term_selection"] == []
    assert {"elbow_joint.gravity_compliance", "elbow_joint.transmission_2_sin"} <= set(found["parameters"])


def test_several_files_are_one_set(run, ur5_folder: Path, some: Path) -> None:
    header, rows = read_csv(some)
    halves = [write_csv(ur5_folder / f"half{k}.csv", header, rows[k::2]) for k in (0, 1)]
    found = run("calibrate", ur5_folder / "robot.yaml", *halves, "--terms", "kinematic", "--json").document
    assert found["calibration"]["rigid"]["poses"] == len(rows)


def test_verifying_on_the_calibration_file_is_remarked(run, ur5_folder: Path, some: Path) -> None:
    robot = ur5_folder / "robot.yaml"
    run("calibrate", robot, some, "--terms", "kinematic")
    copied = ur5_folder / "renamed.csv"
    copied.write_bytes(some.read_bytes())
    assert "fitted to renamed.csv" in " ".join(run("verify", robot, copied, "--json").document["remarks"])
    fresh = run("verify", robot, ur5_folder / "random.csv", "--json").document
    assert fresh["remarks"] == [] and fresh["rms_mm"]["expected"] > fresh["rms_mm"]["parameters"]
    assert fresh["rms_mm"]["parameters"] < fresh["rms_mm"]["measured"] < 0.2


def test_a_column_with_the_wrong_sign_is_remarked(run, ur5_folder: Path, some: Path) -> None:
    """The fit may look perfect; an axis that turned round does not."""
    robot, arguments = ur5_folder / "robot.yaml", ("--terms", "kinematic", "--json")
    right = run("calibrate", robot, some, *arguments).document
    assert not right["fit"]["is_implausible"] and "look for a column" not in " ".join(right["remarks"])
    header, rows = read_csv(some)
    rows[:, header.index("q4")] *= -1
    write_csv(some, header, rows)
    wrong = run("calibrate", robot, some, *arguments)
    assert (
        "flexcal verify" not in wrong.err
        and f"flexcal import {robot} {some} looks for the error" in wrong.err
    )
    remarks = " ".join(wrong.document["remarks"])
    assert "implausibly far" in remarks and "wrist_1_joint.misalignment_" in remarks
    assert remarks.count("look for a column with wrong sign") == 1


def test_scatter_that_no_instrument_has_is_remarked(
    run, ur5_folder: Path, some: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sought = []

    def counted(*fit) -> Coupling | None:
        sought.append(fit)
        return undeclared_coupling(*fit)

    monkeypatch.setattr(result, "undeclared_coupling", counted)
    header, rows = read_csv(some)
    rows, at = rows[::2], [header.index(key) for key in ("q2", "q3")]
    rows[:, at] = rows[:, at[::-1]]
    write_csv(some, header, rows)
    arguments = ("calibrate", ur5_folder / "robot.yaml", some, "--terms", "kinematic")
    page = run(*arguments)
    assert "too large for noise" in page.out and page.out.count("look for a column") == 1
    write_csv(some, [*header, "sigma"], np.hstack([rows, np.full((len(rows), 1), 5e-5)]))
    page = run(*arguments)
    assert (
        "in addition to the stated sigma of 0.05 mm" in page.out and page.out.count("look for a column") == 1
    )
    assert len(sought) == 2, "the cause is sought once a calibration: it takes several fits"


@pytest.fixture
def elastic_poses(tx90l_folder: Path, rng: np.random.Generator) -> Path:
    """60 points of the nominal TX90L, deflected, with torques and temperature."""
    model = RobotModel.from_yaml(tx90l_folder / "robot.yaml")
    q = rng.uniform(-1.5, 1.5, (60, model.n))
    rest = static_equilibrium(model, q)
    point = point_kinematics(model, q, rest.deflection, jacobians=False).position
    poses = PoseSet(
        q=q, position=point + 3e-5 * rng.standard_normal(point.shape), sigma=np.full((60, 3), 3e-5), torque=rest.torque,
        payload=None, temperature=np.full(60, 21.0), target=np.full(60, "smr"), station=np.full(60, "tracker"), pose=np.arange(60),
    )  # fmt: skip
    write_poses(tx90l_folder / "poses.csv", poses)
    return tx90l_folder / "poses.csv"


def test_what_is_read_and_not_used_is_said(run, tx90l_folder: Path, elastic_poses: Path) -> None:
    robot = tx90l_folder / "robot.yaml"
    for verb in ("calibrate", "verify"):
        page = run(verb, robot, elastic_poses)
        assert page.status == 0
        assert "torques tau1… in the files are not used" in page.out
        said = {"calibrate": "temperature in the files is not used", "verify": "temperature is not used"}
        assert said[verb] in page.out
    rms = run("verify", robot, elastic_poses, "--json").document["rms_mm"]
    assert rms["parameters"] < rms["expected"] == pytest.approx(0.06, abs=0.01)


def test_nominal_springs_are_said_to_be_nominal(run, tx90l_folder: Path, elastic_poses: Path) -> None:
    robot, estimates = tx90l_folder / "robot.yaml", tx90l_folder / "estimates.yaml"
    remark = "the stiffness was not identified: the nominal one of robot.yaml is used with a standard deviation of 30%"
    assert remark in run("calibrate", robot, elastic_poses).out
    model = RobotModel.from_yaml(robot, estimates=False)
    springs = [n for n in model.values if n.endswith(".stiffness")]
    parameters = Parameters(Parameter(n, "N m/rad", model.value(n), scale="log") for n in springs)
    found = Estimate(parameters, 1e-4 * np.eye(9), 9, (), (True,) * 9, 0.0, 0.0, 0, "converged", "", 0)
    estimates.unlink()
    write_estimates(estimates, "stiffness", found)
    assert "nominal one of robot.yaml" not in run("calibrate", robot, elastic_poses).out


def test_a_secant_scale_frees_the_drives_from_what_stage_one_said(
    run, tx90l_folder: Path, elastic_poses: Path
) -> None:
    """Stage 1 said, to 1 %, that the drives are 8 % stiffer than gravity finds them: with a scale of 10 % the poses decide."""
    robot, estimates = tx90l_folder / "robot.yaml", tx90l_folder / "estimates.yaml"
    model = RobotModel.from_yaml(robot, estimates=False)
    drives = [f"joint_{i}.drive.stiffness" for i in (1, 2, 3)]
    springs = [n for n in model.values if n.endswith(".stiffness")]
    tangent = {n: model.value(n) * (1.08 if n in drives else 1.0) for n in springs}
    parameters = Parameters(Parameter(n, "N m/rad", tangent[n], scale="log") for n in springs)
    found = Estimate(parameters, 1e-4 * np.eye(9), 9, (), (True,) * 9, 0.0, 0.0, 0, "converged", "", 0)
    write_estimates(estimates, "stiffness", found)
    tied = run("calibrate", robot, elastic_poses, "--json").document["parameters"]
    free = run("calibrate", robot, elastic_poses, "--secant-scale", 0.1, "--json").document["parameters"]
    for name in drives:
        assert free[name]["std"] > 1.5 * tied[name]["std"], name
    for name in ("joint_2.drive.stiffness", "joint_3.drive.stiffness"):
        off = [abs(p[name]["estimate"] / model.value(name) - 1) for p in (tied, free)]
        assert off[1] < 0.5 * off[0], name
    blocks = read_estimates(estimates)
    assert (
        blocks["stiffness"].values == tangent
    )  # both stay on file: the tangent of stage 1, the secant of stage 2
    assert blocks["calibration"].provenance["option.secant_scale"] == "0.1"


def test_marginalised_and_reestimated_springs_are_stored_alike(
    run, tx90l_folder: Path, elastic_poses: Path
) -> None:
    stored = []
    for way in ("reestimated", "marginalised"):
        assert run("calibrate", tx90l_folder / "robot.yaml", elastic_poses, "--elasticity", way).status == 0
        stored.append(read_estimates(tx90l_folder / "estimates.yaml")["calibration"])
    one, other = stored
    assert one.parameters.names == other.parameters.names
    std = np.sqrt(np.diag(one.covariance))
    shift = np.abs(one.parameters.coordinates() - other.parameters.coordinates())
    assert (shift <= 1e-3 * std + 1e-12).all()
    np.testing.assert_allclose(np.diag(other.covariance), std**2, rtol=1e-3, atol=1e-30)


def test_poses_of_the_fit_are_known_in_another_file(run, ur5_folder: Path, some: Path) -> None:
    """A verification on a part of the fitted poses is no independent check, whatever the file is called and holds besides."""
    robot = ur5_folder / "robot.yaml"
    assert run("calibrate", robot, some, "--terms", "kinematic").status == 0
    header, rows = read_csv(some)
    fresh_header, fresh = read_csv(ur5_folder / "random.csv")
    assert header == fresh_header
    both = np.vstack([rows[:30], fresh])
    both[:, 0] = np.arange(len(both))
    mixed = write_csv(ur5_folder / "mixed.csv", header, both)
    found = run("verify", robot, mixed, "--json").document
    assert found["fitted"] == [f"30 of these {30 + len(fresh)} points"]
    assert found["verdict"]["trusted"] is None
    assert run("verify", robot, ur5_folder / "random.csv", "--json").document["fitted"] == []


def test_the_next_step_follows_the_verdict(run, ur5_folder: Path, some: Path) -> None:
    robot = ur5_folder / "robot.yaml"
    assert run("calibrate", robot, some, "--terms", "kinematic").status == 0
    assert "next: flexcal export urdf" in run("verify", robot, ur5_folder / "random.csv").out
    header, rows = read_csv(ur5_folder / "random.csv")
    rows[:, header.index("x")] += 0.5
    moved = run("verify", robot, write_csv(ur5_folder / "moved.csv", header, rows))
    assert "Trusted: no" in moved.out
    assert "next: mend what the verdict names" in moved.out


def test_of_very_many_points_an_even_sample_is_fitted_and_all_are_judged(
    run, ur5_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The errors at all points are those that a verification of every point finds."""
    robot, grid = ur5_folder / "robot.yaml", ur5_folder / "grid.csv"
    rows = len(grid.read_text().splitlines()) - 1
    taken = StratifiedSample.of
    monkeypatch.setattr(StratifiedSample, "of", lambda poses: taken(poses, 200))
    outcome = run("calibrate", robot, grid, "--terms", "kinematic", "--json")
    found = outcome.document
    assert found["sample"]["points"] == found["sample"]["all"]["poses"] == rows
    assert found["sample"]["taken"] == found["calibration"]["selected"]["poses"] == 200
    assert f"of {rows} points 200 were fitted" in " ".join(found["remarks"])
    sampled = run("verify", robot, grid, "--json").document
    monkeypatch.setattr(StratifiedSample, "of", lambda poses: None)
    every = run("verify", robot, grid, "--json").document
    for errors in (found["sample"]["all"], sampled["verification"]["measured"]):
        assert errors == pytest.approx(every["verification"]["measured"], rel=1e-9)
    assert every["sample"] is None and sampled["sample"]["taken"] == 200
