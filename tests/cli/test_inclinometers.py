"""The way of someone who has an inclinometer and nothing else: poses, import, calibration, page, held-out readings."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from inclined_arm import NOISE, measured, robot, written
from refusals import assert_refusal, refused

from flexcal import PoseRequest, RobotModel, calibrate, design_poses, read_poses
from flexcal.calibration.fit import fit_geometry

RANGE = 0.6


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    robot(tmp_path, f"std: {NOISE}, range: {RANGE}")
    return tmp_path / "robot.yaml"


def in_range(seed: int, poses: int = 45) -> np.ndarray:
    rows = np.vstack([measured(seed, turned=0.1, at=measured(k)[:, :6]) for k in range(40, 46)])
    return rows[(np.abs(rows[:, 6:]) < RANGE).all(axis=1)][:poses]


def test_designed_poses_are_in_range_and_tell_more_than_random_ones(arm: Path) -> None:
    model = RobotModel.from_yaml(arm)
    designed = design_poses(model, PoseRequest(count=25, candidates=600, measure="level"))
    planned = measured(7, turned=0.0, at=designed.plan.q)
    assert np.abs(planned[:, 6:]).max() < RANGE + 0.03
    stds = {}
    for name, rows in (("planned", planned), ("random", in_range(7, 25))):
        read = read_poses(written(arm.parent, rows), model)
        estimate = fit_geometry(model, read, terms=("kinematic",)).estimate
        told = [n for n in estimate.parameters.names if n.startswith("j") and estimate.std(n) is not None]
        stds[name] = np.mean([estimate.std(n) or 0.0 for n in told])
    assert stds["planned"] < 0.8 * stds["random"]
    document = designed.document()
    zeros = document["zeros"]
    assert zeros["j1"]["std"] == pytest.approx(5e-3)
    assert zeros["j4"]["std"] < 1e-3 and zeros["j4"]["with_tracker"] < 1e-3
    assert document["unseen_mm"] > 10 * document["with_tracker_mm"]


def test_the_command_line_plans_and_names_the_zeros_it_cannot_tell(arm: Path, tmp_path: Path, run) -> None:
    said = run(
        "design",
        "poses",
        arm,
        "--measure",
        "level",
        "--candidates",
        "400",
        "--count",
        "20",
        "--out",
        tmp_path / "p.yaml",
    )
    assert said.status == 0
    assert "level does not tell j1, j2, j3, j6" in said.out and "(with the tracker): j4" in said.out
    text = arm.read_text().replace(f"range: {RANGE}", "range: 0.0001")
    arm.write_text(text)
    assert_refusal(
        run(
            "design", "poses", arm, "--measure", "level", "--candidates", "50", "--out", tmp_path / "p.yaml"
        ).err,
        "E-DESIGN-057",
        "level",
    )


def test_calibrated_alone_it_has_a_page_and_held_out_readings(arm: Path, tmp_path: Path, run) -> None:
    rows, out = in_range(11), tmp_path / "out"
    lines = [",".join([*map(repr, row), f"day{k % 3}"]) for k, row in enumerate(rows.tolist())]
    (tmp_path / "tilts.csv").write_text("\n".join(["q1,q2,q3,q4,q5,q6,tilt_x,tilt_y,day", *lines]) + "\n")
    said = run("calibrate", arm, tmp_path / "tilts.csv", "--hold-out", "day", "--out", out)
    assert said.status == 0, said.err
    assert "mean mm" not in said.out and "rms mrad" in said.out and "mrad (day0" in said.out
    results = json.loads((out / "results.json").read_text())
    level, held_out = results["inclination"]["level"], results["held_out"]
    assert level["before"]["rms_mrad"] > 1 and level["rms_mrad"] == pytest.approx(1e3 * NOISE, rel=0.35)
    assert (
        held_out["mean_mm"] is None
        and 0.8 * level["mean_mrad"] < held_out["mean_mrad"] < 2 * level["mean_mrad"]
    )
    page = (out / "report.html").read_text()
    assert "figure-tilts" in page and "figure-tilt-joints" in page and "no accuracy in millimetres" in page
    written_page = page
    assert run("report", out).status == 0
    assert (out / "report.html").read_text() == written_page
    assert_refusal(
        run("calibrate", arm, tmp_path / "tilts.csv", "--hold-out", "tilt").err, "E-POSES-041", "tilt"
    )


def test_nobody_claims_millimetres_after_inclinometers_alone(arm: Path, tmp_path: Path, run) -> None:
    assert run("calibrate", arm, written(tmp_path, in_range(12)), "--terms", "kinematic").status == 0
    (tmp_path / "commands.csv").write_text("pose,q1,q2,q3,q4,q5,q6\n1,0.1,0.4,-0.5,0.3,0.6,0.2\n")
    for command in (
        ("predict", arm, tmp_path / "commands.csv", "--out", tmp_path / "tool.csv"),
        ("compensate", arm, tmp_path / "tool.csv", "--out", tmp_path / "c.csv"),
        ("export", "urdf", arm, "--out", tmp_path / "x.urdf"),
        ("map", arm, "--out", tmp_path / "map.html", "--json", "--count", "200"),
    ):
        said = run(*command)
        assert said.status == 0, said.err
        assert "inclinometers alone" in said.out
        if command[0] == "map":
            assert json.loads(said.out)["predicted"]["mean"]["median_mm"] > 0.5


def test_files_of_others_are_imported(arm: Path, tmp_path: Path, run) -> None:
    rows = np.rad2deg(in_range(13))
    lines = [";".join(f"{value:.6f}" for value in row) for row in rows]
    (tmp_path / "foreign.csv").write_text(
        "\n".join(["A1;A2;A3;A4;A5;A6;Neigung X [deg];Neigung Y [deg]", *lines]) + "\n"
    )
    said = run("import", arm, tmp_path / "foreign.csv", "--out", tmp_path / "own.csv")
    assert said.status == 0, said.err
    read = read_poses(tmp_path / "own.csv", RobotModel.from_yaml(arm))
    assert read.tilt is not None
    np.testing.assert_allclose(read.tilt[:, :2], np.deg2rad(rows[:, 6:]), atol=1e-7)


def test_a_base_that_moves_is_imported(examples: Path, tmp_path: Path, run) -> None:
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(3)
    rows = np.loadtxt(examples / "ur5_tracker" / "grid.csv", delimiter=",", skiprows=1)[::40]
    lines = [
        "J1,J2,J3,J4,J5,J6,x [mm],y [mm],z [mm],Base x [mm],Base y [mm],Base z [mm],base_qw,base_qx,base_qy,base_qz"
    ]
    for row in rows:
        turn, base = Rotation.from_rotvec([0, 0, rng.uniform(-3, 3)]), rng.uniform(0, 4, 3)
        x, y, z, w = turn.as_quat()
        numbers = [*row[1:7], *1e3 * (turn.apply(row[7:10]) + base), *1e3 * base, w, x, y, z]
        lines.append(",".join(map(repr, map(float, numbers))))
    (tmp_path / "cart.csv").write_text("\n".join(lines) + "\n")
    robot_file = examples / "ur5_tracker" / "robot.yaml"
    said = run("import", robot_file, tmp_path / "cart.csv", "--out", tmp_path / "own.csv")
    assert said.status == 0, said.err
    header = (tmp_path / "own.csv").read_text().splitlines()[0]
    assert header.endswith("base_x,base_y,base_z,base_qw,base_qx,base_qy,base_qz")
    read = read_poses(tmp_path / "own.csv", RobotModel.from_yaml(robot_file, estimates=False))
    np.testing.assert_allclose(read.position, rows[:, 7:10], atol=1e-9)


def test_bad_input_is_told(arm: Path, tmp_path: Path) -> None:
    model = RobotModel.from_yaml(arm)
    rows = in_range(14)
    beyond = rows.copy()
    beyond[3, 6] = 0.7
    with refused("E-POSES-073", "line 5", "range"):
        read_poses(written(tmp_path, beyond), model)
    with refused("E-RUN-105", "other", "recording 'a'"):
        two = RobotModel.from_yaml(_second_sensor(arm))
        lines = [
            f"{','.join(map(repr, row))},{'level' if k % 2 else 'other'}"
            for k, row in enumerate(rows.tolist())
        ]
        (tmp_path / "two.csv").write_text(
            "\n".join(["q1,q2,q3,q4,q5,q6,tilt_x,tilt_y,inclinometer", *lines]) + "\n"
        )
        poses = read_poses(tmp_path / "two.csv", two)
        labels = np.where(poses.target == "level", "b", "a")
        calibrate(two, poses, terms=["kinematic"], hold_out=("recording", labels))
    arm.write_text(arm.read_text().replace(f"range: {RANGE}", "range: -1"))
    with refused("E-ROBOT-078", "range"):
        RobotModel.from_yaml(arm)


def _second_sensor(arm: Path) -> Path:
    second = arm.with_name("second.yaml")
    second.write_text(
        arm.read_text().replace(
            "measurements: {", "measurements: {other: {kind: inclinometer, frame: l6, std: 5e-5}, "
        )
    )
    return second


def test_points_without_sigma_beside_a_stated_inclinometer(arm: Path, tmp_path: Path) -> None:
    arm.write_text(arm.read_text() + "points: {ball: {frame: l6, xyz: [0.05, 0.02, 0.1]}}\n")
    model, rows = RobotModel.from_yaml(arm), in_range(15)
    lines = [
        f"{k},{','.join(map(repr, row[:6]))},0.1,{0.01 * k!r},0.3" for k, row in enumerate(rows.tolist())
    ]
    (tmp_path / "points.csv").write_text("\n".join(["pose,q1,q2,q3,q4,q5,q6,x,y,z", *lines]) + "\n")
    with refused("E-POSES-025", "points have no sigma", "level", "std:"):
        read_poses([tmp_path / "points.csv", written(tmp_path, rows)], model)
