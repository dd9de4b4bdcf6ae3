"""`design trajectory` for a robot of another maker: what it asks for, and its motions as timed positions, checked with Pinocchio alone."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import yaml
from mcap_messages import trajectory_in
from refusals import assert_refusal

URDF = """<robot name="gantry"><link name="base"/>
<link name="carriage"><inertial><origin xyz="0.02 0.01 0.1"/><mass value="12"/>
 <inertia ixx="0.2" iyy="0.25" izz="0.3" ixy="0.01" ixz="0" iyz="0.02"/></inertial></link>
<link name="upper"><inertial><origin xyz="0.2 0 0.02"/><mass value="6"/>
 <inertia ixx="0.03" iyy="0.15" izz="0.16" ixy="0" ixz="0.01" iyz="0"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.15 0.01 0"/><mass value="3"/>
 <inertia ixx="0.01" iyy="0.05" izz="0.06" ixy="0" ixz="0" iyz="0.002"/></inertial></link>
<joint name="rail" type="prismatic"><parent link="base"/><child link="carriage"/><origin xyz="0 0 0.8"/><axis xyz="1 0 0"/>
 <limit lower="-0.6" upper="0.6" velocity="1.0" effort="400"/></joint>
<joint name="shoulder" type="revolute"><parent link="carriage"/><child link="upper"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
 <limit lower="-1.5" upper="1.5" velocity="3" effort="120"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
 <limit lower="-2.2" upper="2.2" velocity="4" effort="50"/></joint></robot>"""
FRICTION = np.array([[60.0, 8.0, 3.0], [25.0, 6.0, 2.0]])
ROTOR = np.array([8.0, 0.5, 0.2])


@pytest.fixture
def gantry(tmp_path: Path) -> Path:
    (tmp_path / "gantry.urdf").write_text(URDF)
    robot = tmp_path / "robot.yaml"
    robot.write_text(f"robot: gantry.urdf\ndrives: {{rotor_inertia: {ROTOR.tolist()}}}\n")
    return robot


def torques(folder: Path, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    model = pin.buildModelFromUrdf(str(folder / "gantry.urdf"))
    data = model.createData()
    rigid = np.array([pin.rnea(model, data, *row) for row in zip(q, dq, ddq, strict=True)])
    return rigid + ROTOR * ddq + FRICTION[0] * dq + FRICTION[1] * np.sign(dq)


def motion(file: Path) -> tuple[list[str], np.ndarray]:
    with file.open() as stream:
        header, *rows = csv.reader(stream)
    return header, np.array(rows, dtype=float)


def test_written_samples_keep_the_limits_from_rest_to_rest(run, gantry: Path) -> None:
    folder = gantry.parent
    asked = ("--count", 2, "--searches", 1, "--out", folder / "plan.yaml", "--json")
    outcome = run("design", "trajectory", gantry, *asked)
    assert outcome.status == 0 and "no friction of rail, shoulder, elbow" in outcome.err
    # a URDF without collision shapes: that they are kept apart is not claimed
    assert "no collision shapes, so collisions are not excluded" in outcome.err
    page = " ".join((folder / "plan.html").read_text("utf-8").split())
    assert "Cannot be judged: the URDF has no collision shapes" in page and "With care" in page
    model = pin.buildModelFromUrdf(str(folder / "gantry.urdf"))
    for number in (1, 2):
        header, rows = motion(folder / f"plan_{number}.csv")
        assert header == ["t", *(f"{kind}{j}" for kind in ("q", "dq", "ddq") for j in (1, 2, 3))]
        t, (q, dq, ddq) = rows[:, 0], np.split(rows[:, 1:], 3, axis=1)
        assert t[0] == 0 and np.allclose(np.diff(t), 0.01, atol=1e-8) and t[-1] == pytest.approx(20.0)
        for end in (0, -1):
            assert not dq[end].any() and not ddq[end].any()
        assert (q > model.lowerPositionLimit).all() and (q < model.upperPositionLimit).all()
        assert (np.abs(dq) < 0.8001 * model.velocityLimit).all()
        assert (np.abs(torques(folder, q, dq, ddq)) < 0.85 * model.effortLimit).all()
        # neighbours agree with their velocities and accelerations to the fourth order
        ahead = q[:-1] + 0.01 * (dq[:-1] + dq[1:]) / 2 - 1e-4 * (ddq[1:] - ddq[:-1]) / 12
        assert np.abs(q[1:] - ahead).max() < 1e-7
        message = yaml.safe_load((folder / f"plan_{number}_ros.yaml").read_text())
        assert message["joint_names"] == ["rail", "shoulder", "elbow"]
        points = message["points"]
        for key, values in (("positions", q), ("velocities", dq), ("accelerations", ddq)):
            assert np.array_equal([point[key] for point in points], values)
        since = [point["time_from_start"] for point in points]
        assert all(type(at["sec"]) is int and 0 <= at["nanosec"] < 10**9 for at in since)
        assert np.allclose([at["sec"] + 1e-9 * at["nanosec"] for at in since], t, atol=1e-9)


def test_a_log_of_the_written_motion_identifies_the_robot(run, gantry: Path) -> None:
    """Recorded from the first sample on, run-up and run-down included."""
    folder = gantry.parent
    asked = ("--rate", 1000, "--out", folder / "plan.yaml")
    assert run("design", "trajectory", gantry, "--count", 1, "--searches", 1, *asked).status == 0
    _, rows = motion(folder / "plan_1.csv")
    q, dq, ddq = np.split(rows[:, 1:], 3, axis=1)
    logs = folder / "logs"
    logs.mkdir()
    tau = torques(folder, q, dq, ddq) + 0.05 * np.random.default_rng(3).standard_normal(q.shape)
    lines = ["t,q1,q2,q3,tau1,tau2,tau3"]
    lines += [",".join(f"{v:.9g}" for v in row) for row in np.column_stack([rows[:, 0], q, tau])]
    (logs / "pose_1_realisation_1_experiment_1_plus.csv").write_text("\n".join(lines) + "\n")
    (logs / "plan.yaml").write_text((folder / "plan.yaml").read_text())
    found = run("identify", "inertials", gantry, logs, "--json").document["parameters"]
    for name, true in (("rail.viscous", 60.0), ("elbow.coulomb", 2.0), ("shoulder.viscous", 8.0)):
        assert found[name]["estimate"] == pytest.approx(true, rel=0.05)


def test_logs_of_any_name_rate_and_beginning(run, gantry: Path, tmp_path: Path) -> None:
    """Two trajectories, with names exchanged, recorded by hand at another rate than planned, with the robot at rest before and after."""
    folder = gantry.parent
    asked = ("--rate", 1000, "--out", folder / "plan.yaml")
    assert run("design", "trajectory", gantry, "--count", 2, "--searches", 1, *asked).status == 0
    logs = tmp_path / "logs"
    logs.mkdir()
    rng = np.random.default_rng(8)
    for number, name, before in ((1, "second", 3.217), (2, "pose_1_realisation_1_experiment_1_plus", 0.6)):
        _, rows = motion(folder / f"plan_{number}.csv")
        time = np.arange(0, rows[-1, 0] + before + 2, 1 / 640.0)
        at = np.clip(time - before, 0, rows[-1, 0])
        q, dq, ddq = (
            np.stack([np.interp(at, rows[:, 0], column) for column in part.T], axis=1)
            for part in np.split(rows[:, 1:], 3, axis=1)
        )
        tau = torques(folder, q, dq, ddq) + 0.05 * rng.standard_normal(q.shape)
        lines = ["t,q1,q2,q3,tau1,tau2,tau3"]
        lines += [",".join(f"{v:.9g}" for v in row) for row in np.column_stack([time + 7.0, q, tau])]
        (logs / f"{name}.csv").write_text("\n".join(lines) + "\n")
    measure = ("measure", folder / "plan.yaml", "--cell", logs, "--out", tmp_path / "exciting", "--json")
    document = run(*measure).document
    found = {Path(entry["file"]).stem: entry for entry in document["found"]}
    assert found["second"]["recording"] == "pose_1_realisation_1_experiment_1_plus"
    assert found["second"]["start_s"] == pytest.approx(3.217, abs=0.01)
    assert document["remarks"] == [
        "logs are taken as what they hold, not by their names: "
        "pose_1_realisation_1_experiment_1_plus.csv is pose_1_realisation_2_experiment_1_plus"
    ]
    parameters = run("identify", "inertials", gantry, tmp_path / "exciting", "--json").document["parameters"]
    for name, true in (("rail.viscous", 60.0), ("elbow.coulomb", 2.0), ("shoulder.viscous", 8.0)):
        assert parameters[name]["estimate"] == pytest.approx(true, rel=0.05)
    (logs / "second.csv").unlink()
    assert_refusal(run(*measure[:-1]).err, "E-EXP-019", "1 of 2", "pose_1_realisation_1_experiment_1_plus")


@pytest.mark.parametrize("seeds", [range(40, 42), pytest.param(range(40, 46), marks=pytest.mark.slow)])
def test_seeds_end_at_like_conditions(gantry: Path, seeds: range) -> None:
    from flexcal.design.optimality import condition_number
    from flexcal.jobs.experiments import TrajectoryRequest
    from flexcal.model.robot import RobotModel

    model = RobotModel.from_yaml(gantry)
    conditions = []
    for seed in seeds:
        best = TrajectoryRequest(count=1, seed=seed).optimise(model)[0]
        conditions.append(condition_number(best.information[-1]))
    assert max(conditions) < 1.3 * min(conditions)


@pytest.mark.parametrize(
    ("pattern", "lacking", "refusal"),
    [
        ('velocity="1.0"', 'velocity="0"', ["E-DESIGN-051", "rail", "velocity"]),
        ('effort="50"', 'effort="0"', ["E-DESIGN-051", "elbow", "effort"]),
        (r"(?s)<inertial>.*?</inertial>", "", ["E-DESIGN-052"]),
    ],
)
def test_what_the_urdf_lacks_is_asked_for(
    run, gantry: Path, pattern: str, lacking: str, refusal: list[str]
) -> None:
    (gantry.parent / "gantry.urdf").write_text(re.sub(pattern, lacking, URDF))
    outcome = run("design", "trajectory", gantry, "--count", 1, "--out", gantry.parent / "plan.yaml")
    assert outcome.status == 2 and "nan" not in outcome.err
    assert_refusal(outcome.err, *refusal)
    assert not list(gantry.parent.glob("plan*"))


def test_a_file_of_another_beside_the_plan_is_refused(run, gantry: Path) -> None:
    """And those of an earlier plan with more trajectories go."""
    folder, quick = gantry.parent, ("--searches", 1, "--steps", 2)
    plan = ("design", "trajectory", gantry, *quick, "--out", folder / "plan.yaml")
    assert run(*plan, "--count", 2).status == 0 and run(*plan, "--count", 1).status == 0
    assert sorted(path.name for path in folder.glob("plan*")) == [
        "plan.html",
        "plan.yaml",
        "plan_1.csv",
        "plan_1_ros.yaml",
    ]
    assert run(*plan, "--count", 1, "--ros", "mcap").status == 0
    assert sorted(path.name for path in folder.glob("plan_*")) == ["plan_1.csv", "plan_1_ros.mcap"]
    message, rows = trajectory_in(folder / "plan_1_ros.mcap"), motion(folder / "plan_1.csv")[1]
    assert message.joint_names == ["rail", "shoulder", "elbow"]
    written = [np.concatenate([p.positions, p.velocities, p.accelerations]) for p in message.points]
    assert np.array_equal(written, rows[:, 1:])
    (folder / "plan_2.csv").write_text("mine\n")
    outcome = run(*plan, "--count", 2)
    assert outcome.status == 2
    assert_refusal(outcome.err, "E-CLI-013", "plan_2.csv")
    assert (folder / "plan_2.csv").read_text() == "mine\n"
