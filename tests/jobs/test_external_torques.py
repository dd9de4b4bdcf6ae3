"""Springs, cables and a force sensor in `identify dynamics`, on a robot simulated in MuJoCo with its own conventions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import polars as pl
import pytest
from pushed_robot import (
    CABLE,
    ELBOW_STIFFNESS,
    KNOWN,
    LIFT_STIFFNESS,
    SPRINGS,
    Pushed,
    pushed,
    pushed_model,
    pushed_torque,
    pushed_yaml,
)
from refusals import refused

from flexcal.dynamics.estimators import ESTIMATORS, EstimatorName
from flexcal.jobs.dynamics import identify_robot_dynamics
from flexcal.model.robot import RobotModel
from flexcal.model.torques import wrench_torque

_NOISE = 0.005


@pytest.fixture(scope="module")
def motion() -> Pushed:
    return pushed(1, 20.0)


@pytest.fixture(scope="module")
def other() -> Pushed:
    return pushed(2, 8.0, push=1.5)


def tared(robot: Path) -> Path:
    """A sensor that reads zero without load."""
    robot.write_text(robot.read_text().replace("wrench: on_robot", "wrench: on_robot, offset: zero"))
    return robot


def error(document: dict) -> float:
    return document["error_percent"]["held_out"]


def test_the_wrench_acts_where_the_sensor_is(tmp_path: Path) -> None:
    """At any joint positions, on a flange that is turned and moved from the last joint, and as MuJoCo applies it."""
    robot = RobotModel.from_yaml(pushed_yaml(tmp_path))
    model = pushed_model()
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    q, wrench = rng.uniform(-1.0, 1.0, (20, 4)), rng.normal(size=(20, 6))
    for own, one, torque in zip(q, wrench, wrench_torque(robot, q, wrench), strict=True):
        data.qpos[:] = own
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(torque, pushed_torque(model, data, one), atol=1e-12)


def test_springs_and_cables_are_found(tmp_path: Path, motion: Pushed, other: Pushed) -> None:
    """Of a lift and of a joint that turns, in their units; a constant is what the offset absorbs, and is written beside it."""
    robot = pushed_yaml(tmp_path, dynamics=SPRINGS)
    logs = [motion.write(tmp_path / "a.csv", noise=_NOISE), other.write(tmp_path / "b.csv", seed=1)]
    found = identify_robot_dynamics(robot, logs[:1], validate=logs[1:], out=tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "lift (N)" in page and "torque / N m, force / N" in page
    document = found.document()
    for name, truth in (("lift", LIFT_STIFFNESS), ("elbow", ELBOW_STIFFNESS)):
        item = document["parameters"][f"{name}.spring_stiffness"]
        assert item["low"] < truth < item["high"] and item["std"] < 0.02 * truth
    units = {row["name"].split()[0]: row["unit"] for row in document["base_parameters"]}
    assert units["lift.spring_stiffness"] == "N/m" and units["elbow.spring_stiffness"] == "N m/rad"
    assert (
        units["lift.coulomb"] == "N"
        and units["lift.viscous"] == "N s/m"
        and units["roll.viscous"] == "N m s/rad"
    )
    written = [row["name"] for row in document["base_parameters"]]
    assert any(name.startswith("roll.torque_offset + roll.cable_torque") for name in written)
    assert any(name.startswith("elbow.torque_offset + elbow.spring_torque") for name in written)
    offset = next(
        r["estimate"] for r in document["base_parameters"] if r["name"].startswith("roll.torque_offset")
    )
    assert offset == pytest.approx(CABLE, abs=0.1) and error(document) < 0.5
    assert not any("cable" in remark for remark in document["remarks"])


def test_what_robot_yaml_knows_is_taken_from_the_torques(
    tmp_path: Path, motion: Pushed, other: Pushed
) -> None:
    logs = [motion.write(tmp_path / "a.csv", noise=_NOISE), other.write(tmp_path / "b.csv", seed=1)]
    document = identify_robot_dynamics(
        pushed_yaml(tmp_path, dynamics=KNOWN), logs[:1], validate=logs[1:]
    ).document()
    assert not any("spring" in name or "cable" in name for name in document["parameters"])
    assert error(document) < 0.5
    offset = document["parameters"]["roll.torque_offset"]
    assert abs(offset["estimate"]) < 4 * offset["std"] < 0.2
    bare = identify_robot_dynamics(pushed_yaml(tmp_path), logs[:1], validate=logs[1:]).document()
    assert error(bare) > 3.0


@pytest.mark.parametrize("estimator", [name for name in ESTIMATORS if name != "ml"])
def test_every_estimator_counts_the_wrench(
    estimator: EstimatorName, tmp_path: Path, motion: Pushed, other: Pushed
) -> None:
    """The external torques are a third of the motors'; without them nothing fits."""
    robot = tared(pushed_yaml(tmp_path, dynamics=SPRINGS))
    logs = [motion.write(tmp_path / "a.csv", noise=_NOISE), other.write(tmp_path / "b.csv", seed=1)]
    document = identify_robot_dynamics(robot, logs[:1], validate=logs[1:], estimator=estimator).document()
    assert error(document) < (2.0 if estimator == "ekf" else 1.0)
    share = document["external_share"]
    assert share["low"] - 1e-3 < 1.0 < share["high"] + 1e-3


def test_maximum_likelihood_counts_the_wrench(tmp_path: Path, other: Pushed) -> None:
    """One motion five times, pushed otherwise every time: what stays of the period is the sum of both torques."""
    parts = [pushed(1, 1 / 0.13, push=share) for share in (0.0, 0.5, 1.0, 0.2, 0.8)]
    q, torque, wrench = (
        np.concatenate([getattr(p, key)[:769] for p in parts]) for key in ("q", "torque", "wrench")
    )
    robot = tared(pushed_yaml(tmp_path, dynamics=SPRINGS))
    repeated = Pushed(np.arange(len(q)) / 100.0, q, torque, wrench)
    logs = [repeated.write(tmp_path / "a.csv", noise=_NOISE), other.write(tmp_path / "b.csv", seed=1)]
    document = identify_robot_dynamics(robot, logs[:1], validate=logs[1:], estimator="ml").document()
    assert error(document) < 2.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("sign", "The sign is the other one: correct `wrench:`"),
        ("unit", "Check frame, axes, unit"),
        ("frame", "Check frame, axes, unit"),
    ],
)
def test_a_wrong_sensor_is_seen(change: str, words: str, tmp_path: Path, motion: Pushed) -> None:
    log = motion.write(tmp_path / "a.csv", noise=_NOISE, sign=1e-3 if change == "unit" else 1.0)
    robot = pushed_yaml(
        tmp_path, dynamics=SPRINGS, wrench="on_environment" if change == "sign" else "on_robot"
    )
    if change == "frame":
        robot.write_text(robot.read_text().replace("rpy: [0.3", "rpy: [1.9"))
    found = identify_robot_dynamics(robot, [log])
    assert found.trust.status == "bad" and any(words in check.answer for check in found.trust.deciding)
    assert "the motors do not feel what the force sensor reads" in found.trust.sentence


def test_the_offset_of_a_sensor_is_found(tmp_path: Path, motion: Pushed, other: Pushed) -> None:
    """As of one that was tared with a tool: it reads the same too much all the time."""
    offset = np.array([6.0, -4.0, 9.0, 0.5, -0.8, 0.3])
    logs = [
        replace(each, wrench=each.wrench + offset).write(tmp_path / f"{k}.csv", noise=_NOISE * (k == 0))
        for k, each in enumerate((motion, other))
    ]
    robot = pushed_yaml(tmp_path, dynamics=SPRINGS)
    document = identify_robot_dynamics(robot, logs[:1], validate=logs[1:]).document()
    assert error(document) < 0.5
    for name, value in zip(("fx", "fy", "fz", "mx", "my", "mz"), offset, strict=True):
        item = document["parameters"][f"force_sensor.{name}_offset"]
        assert item["identifiable"] is False or abs(item["estimate"] - value) < 4 * item["std"], name
    seen = [name for name in document["parameters"] if name.startswith("force_sensor.")]
    assert sum(document["parameters"][name]["identifiable"] for name in seen) >= 5
    assert not any("force_sensor" in remark for remark in document["remarks"])
    stored = RobotModel.from_yaml(robot)
    assert (
        stored.value("lift.spring_stiffness") == document["parameters"]["lift.spring_stiffness"]["estimate"]
    )


def test_columns_and_sensor_belong_together(tmp_path: Path, motion: Pushed) -> None:
    log = motion.write(tmp_path / "a.csv")
    with refused("E-DYN-031", "robot.yaml"):
        identify_robot_dynamics(pushed_yaml(tmp_path, wrench=""), [log])
    table = pl.read_csv(log)
    table.drop("mx", "my", "mz").write_csv(log)
    with refused("E-DYN-032", "mx, my, mz"):
        identify_robot_dynamics(pushed_yaml(tmp_path), [log])
    table.drop("fx", "fy", "fz", "mx", "my", "mz").write_csv(log)
    with refused("E-RUN-059"):
        identify_robot_dynamics(pushed_yaml(tmp_path), [log])


def test_guessed_masses_can_be_accepted(tmp_path: Path, motion: Pushed, other: Pushed) -> None:
    """Masses forty times too large in the URDF look like torques on the motor side; accepted, the fit is as good and says so."""
    robot = pushed_yaml(tmp_path, dynamics=SPRINGS)
    urdf = tmp_path / "pushed.urdf"
    text = urdf.read_text()
    for mass in ("20", "9", "5", "2"):
        text = text.replace(f'<mass value="{mass}"/>', f'<mass value="{mass}00"/>')
    urdf.write_text(text)
    logs = [motion.write(tmp_path / "a.csv", noise=_NOISE), other.write(tmp_path / "b.csv", seed=1)]
    with refused("E-RUN-061", "torque of roll is only", "go on with --accept weight"):
        identify_robot_dynamics(robot, logs[:1], validate=logs[1:])
    found = identify_robot_dynamics(robot, logs[:1], validate=logs[1:], accept_weight=True)
    assert "weight" in {check.code for check in found.trust.deciding}
    assert "which was accepted" in found.trust.sentence and error(found.document()) < 5.0
    pushed_yaml(tmp_path, dynamics=SPRINGS.replace("{joint: elbow}", "{joint: elbow}, {joint: roll}"))
    urdf.write_text(text)
    identify_robot_dynamics(robot, logs[:1])  # a declared spring may balance the joint
