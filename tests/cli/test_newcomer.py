"""From an empty folder to a calibrated URDF, with a robot of no example and a file of foreign columns: every step names the next."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from newcomer_robot import JOINTS, MARK, tracked, true_robot, urdf_text, write_foreign

from flexcal.data.plans import read_plan
from flexcal.data.poses import read_poses
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel


def following(outcome) -> str:
    """What a verb said to do next."""
    assert outcome.status == 0, outcome.err
    return outcome.out.rsplit("next: ", 1)[1]


def test_from_a_urdf_to_a_calibrated_urdf(run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("newcomer.urdf").write_text(urdf_text())

    begun = run("init", "newcomer.urdf")
    assert f"6 joints ({', '.join(JOINTS)})" in begun.out and "finger_left at 0.01" in begun.out
    assert "flexcal design poses robot.yaml --out poses.yaml" in following(begun)
    robot = Path("robot.yaml")
    robot.write_text(robot.read_text().replace("xyz: [0.0, 0.0, 0.0]", f"xyz: {MARK.tolist()}"))

    planned = run("design", "poses", robot, "--out", "poses.yaml", "--count", "28", "--candidates", "300")
    assert "flexcal import robot.yaml FILE" in following(planned)
    drawn = run("design", "poses", robot, "--random", "--count", "15", "--seed", "3", "--out", "others.yaml")
    assert "flexcal import robot.yaml FILE" in following(drawn)
    nominal = RobotModel.from_yaml(robot)
    for name, seed in (("poses", 1), ("others", 2)):
        q = read_plan(Path(f"{name}.yaml")).q
        write_foreign(Path(f"{name}_tracker.csv"), q, tracked(nominal, q, seed))

    shown = run("import", robot, "poses_tracker.csv")
    assert "--out poses.csv" in following(shown) and not Path("poses.csv").exists()
    assert "left out: Remark" in shown.out
    imported = run("import", robot, "poses_tracker.csv", "--out", "poses.csv")
    assert "flexcal calibrate robot.yaml poses.csv" in following(imported)
    poses = read_poses("poses.csv", nominal)
    np.testing.assert_allclose(poses.q, read_plan(Path("poses.yaml")).q, atol=1e-8)

    calibrated = run("calibrate", robot, "poses.csv", "--terms", "kinematic")
    assert "flexcal verify robot.yaml" in following(calibrated)
    # once there is a calibration, poses are taken to check it
    others = run("import", robot, "others_tracker.csv", "--out", "others.csv")
    assert following(others).startswith("flexcal verify robot.yaml others.csv")
    verified = run("verify", robot, "others.csv", "--json")
    assert verified.document["verification"]["measured"]["mean_mm"] < 0.1
    assert "next: flexcal export urdf robot.yaml" in verified.err
    assert "flexcal compensate robot.yaml" in verified.err and "flexcal map robot.yaml" in verified.err

    Path("targets.csv").write_text("pose,q1,q2,q3,q4,q5,q6\n1,0.2,-0.3,0.4,0.5,-0.6,0.7\n")
    assert "run commands.csv on the robot" in following(
        run("compensate", robot, "targets.csv", "--out", "commands.csv")
    )
    assert run("export", "urdf", robot, "--out", "calibrated.urdf").status == 0

    # the exported robot is the true one: its flange moves as that does, up to where the base stands
    Path("check").mkdir()
    text = (
        robot.read_text()
        .replace("newcomer.urdf", "../calibrated.urdf")
        .replace(f"frame: flange, xyz: {MARK.tolist()}", "frame: smr, xyz: [0, 0, 0]")
    )
    Path("check/robot.yaml").write_text(text)
    found = RobotModel.from_yaml("check/robot.yaml")
    q = np.random.default_rng(5).uniform(-1.5, 1.5, (40, 6))
    here = point_kinematics(found, q, jacobians=False).position
    there = point_kinematics(true_robot(nominal), q, jacobians=False).position
    distances = [np.linalg.norm(x[:, None] - x[None], axis=2) for x in (here, there)]
    assert np.abs(distances[0] - distances[1]).max() < 3e-4
    before = point_kinematics(nominal, q, jacobians=False).position
    assert np.abs(np.linalg.norm(before[:, None] - before[None], axis=2) - distances[1]).max() > 2e-3
