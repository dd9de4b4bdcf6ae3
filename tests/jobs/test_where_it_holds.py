"""Exports, certificates and the server say where a calibration does not hold."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from flexcal import (
    CalibratedRobot,
    PoseSet,
    RobotModel,
    ToolTargets,
    calibrate,
    certify,
    export_robot,
    read_poses,
)
from flexcal.jobs.inputs import beyond_calibration
from flexcal.jobs.serving import Answers
from flexcal.kernels import RuntimeRobot

SAYS = "the predicted error is above three times that near the calibrated poses"


@pytest.fixture(scope="module")
def nominal(examples: Path) -> RobotModel:
    return RobotModel.from_yaml(examples / "ur5_tracker" / "robot.yaml", estimates=False)


def poses_within(nominal: RobotModel, examples: Path, reach: float, count: int) -> PoseSet:
    """Points of the nominal robot by Pinocchio with 50 µm of noise, joints within ± `reach` rad of an elbow-up posture."""
    like = read_poses(examples / "ur5_tracker" / "grid.csv", nominal).subset(slice(count))
    read = pin.buildModelFromUrdf(str(nominal.urdf))
    data, frame = read.createData(), read.getFrameId("tool0")
    rng = np.random.default_rng(5)
    q = np.array([0.0, -1.2, 1.5, 0.3, 0.8, 0.0]) + rng.uniform(-reach, reach, (count, 6))
    points = np.zeros((count, 3))
    for k, own in enumerate(q):
        pin.framesForwardKinematics(read, data, own)
        points[k] = data.oMf[frame].act(np.array([0, 0, 0.031]))
    return replace(like, q=q, position=points + 5e-5 * rng.normal(size=(count, 3)))


@pytest.fixture(scope="module")
def narrow(nominal: RobotModel, examples: Path) -> CalibratedRobot:
    return calibrate(nominal, poses_within(nominal, examples, 0.1, 60), terms=["kinematic"]).robot


def test_an_export_says_that_the_poses_it_is_for_are_beyond(
    narrow: CalibratedRobot, nominal: RobotModel, examples: Path, tmp_path: Path
) -> None:
    exported = export_robot(narrow, tmp_path / "dh.csv", "mdh")
    (remark,) = (each for each in exported.document()["remarks"] if SAYS in each)
    assert "random poses of the joint range" in remark and remark in exported.summary()
    everywhere = calibrate(nominal, poses_within(nominal, examples, np.pi, 120), terms=["kinematic"]).robot
    for robot in (everywhere, CalibratedRobot(nominal, nominal, {})):
        assert SAYS not in export_robot(robot, tmp_path / "robot.json", "json").summary()


def test_no_pose_is_said_to_be_where_it_holds_if_none_is(
    nominal: RobotModel, examples: Path, tmp_path: Path
) -> None:
    robot = calibrate(nominal, poses_within(nominal, examples, 0.03, 60), terms=["kinematic"]).robot
    said = export_robot(robot, tmp_path / "robot.json", "json").summary()
    assert "at 2000 of 2000 random poses" in said and "where the calibration holds" not in said
    assert "1000 random poses of the joint range, all within the joint ranges of the calibration" in said


def test_a_certificate_says_which_points_are_beyond(
    narrow: CalibratedRobot, nominal: RobotModel, examples: Path
) -> None:
    for reach, beyond in ((0.05, False), (1.0, True)):
        measured = poses_within(nominal, examples, reach, 20)
        targets = ToolTargets(measured.pose, measured.target, q=measured.q)
        found = certify(narrow, targets, measured, measured)
        assert any(SAYS in each for each in found.remarks) is beyond


def test_the_server_says_where_a_pose_is_beyond(narrow: CalibratedRobot) -> None:
    answers = Answers(narrow)
    near, far = (
        json.loads(answers.of(json.dumps({"do": "extent", "q": q}).encode()))
        for q in ([0.0, -1.2, 1.5, 0.3, 0.8, 0.0], [2.0, 0.5, -1.5, 2.0, -1.0, 1.0])
    )
    assert near == {"status": "done", "beyond": 0.0}
    assert far["status"] == "done" and 1e-5 < far["beyond"] < 0.1


@pytest.mark.parametrize("reach", [0.1, 0.6, 2.0])
def test_the_runtime_says_where_the_calibration_may_not_hold(
    nominal: RobotModel, examples: Path, tmp_path: Path, reach: float
) -> None:
    """Wherever the predicted error says it, but for a few in a thousand; nowhere near the calibrated poses; and commands are the same."""
    measured = poses_within(nominal, examples, reach, 60)
    robot = calibrate(nominal, measured, terms=["kinematic"]).robot
    text = export_robot(robot, tmp_path / "robot.json", "runtime").path.read_text()
    document, arm = json.loads(text), RuntimeRobot.read(text)
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (5000, 6))
    around = np.concatenate([q, measured.q[0] + 0.2 * q])
    beyond, predicted = arm.beyond(around, 0), beyond_calibration(robot, around) > 0
    assert (predicted & (beyond == 0)).mean() < 3e-3
    assert not arm.beyond(measured.q, 0).any()
    holds = document["points"][0].pop("holds")
    silent = RuntimeRobot.read(json.dumps(document))
    assert not silent.beyond(around, 0).any()
    if reach == 2.0:
        assert holds is None and not beyond.any()
        return
    lower, upper = (
        np.array([other if end is None else end for end in holds[key]])
        for key, other in (("lower", -np.inf), ("upper", np.inf))
    )
    assert (beyond == ((around < lower) | (around > upper)).any(axis=1)).all()
    assert 0.1 < beyond.mean() < 1.0
    declared = np.full(len(around), np.nan)
    for said, without in zip(
        arm.compensate(around, 0, declared), silent.compensate(around, 0, declared), strict=True
    ):
        assert np.array_equal(said, without, equal_nan=True)
