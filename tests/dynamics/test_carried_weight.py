"""Torques of motors are told from those of joints by the weight that they carry; currents in A are not taken for them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.data.recordings import Recording, write_recording
from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.signals import JointLog, Motion
from flexcal.jobs.logs import require_joint_torques
from flexcal.model.robot import RobotModel
from flexcal.model.torques import inertial_parameters, torque_regressor

STEP = 1 / 200


@pytest.fixture(scope="module")
def recording(swing: Motion, tx40: RobotModel) -> Recording:
    """Ten seconds of motion with the torques that CAD's inertias take, and noise."""
    torque = torque_regressor(tx40, swing.q, swing.dq, swing.ddq) @ Observation(tx40, ()).values()
    return Recording(STEP, swing.q, torque + 0.2 * np.random.default_rng(4).normal(size=swing.q.shape))


def log_of(recording: Recording, model: RobotModel, folder: Path) -> JointLog:
    write_recording(folder / "log.parquet", recording)
    return JointLog.read(folder / "log.parquet", model, 10.0, folder)


def test_torques_before_the_gears(recording: Recording, tx40: RobotModel, tmp_path: Path) -> None:
    log = log_of(replace(recording, torque=recording.torque / 45), tx40, tmp_path)
    with refused("E-RUN-061", "log.parquet", "joint_2", "on the motor side") as caught:
        require_joint_torques([log], tx40)
    assert "joint_2 is only 2." in str(caught.value)


@pytest.mark.parametrize("gain", [1.0, 10.0])
def test_torques_and_currents(gain: float, recording: Recording, tx40: RobotModel, tmp_path: Path) -> None:
    log = log_of(replace(recording, torque=recording.torque / gain), tx40, tmp_path)
    require_joint_torques([log], tx40)
    assert log.weight.share == pytest.approx(1 / gain, rel=0.1)


def test_torques_of_the_other_sign(recording: Recording, tx40: RobotModel, tmp_path: Path) -> None:
    """All of them, as where a robot hangs from a ceiling that robot.yaml does not know, or those of one drive."""
    for signs, joint in ((-np.ones(6), "joint_2"), (np.array([1, 1, -1, 1, 1, 1]), "joint_3")):
        log = log_of(replace(recording, torque=recording.torque * signs), tx40, tmp_path)
        with refused("E-RUN-061", joint, "the sign of its gravity torque instead of the opposite"):
            require_joint_torques([log], tx40)


def test_accelerations_against_the_weight_are_no_other_sign(tx90l: RobotModel, tmp_path: Path) -> None:
    """An arm that hangs and swings fast pushes back at its ends with more than its weight pulls."""
    time = STEP * np.arange(2000)
    swing = 0.4 * np.sin(2 * np.pi * 2.0 * time)
    q, dq, ddq = np.zeros((3, len(time), 6))
    hanging, rate = np.pi, 2 * np.pi * 2.0
    q[:, 1] = hanging + swing
    dq[:, 1], ddq[:, 1] = np.gradient(swing, STEP), -(rate**2) * swing
    noise = np.random.default_rng(5).normal(size=q.shape)
    torque = torque_regressor(tx90l, q, dq, ddq) @ inertial_parameters(tx90l) + 0.1 * noise
    log = log_of(Recording(STEP, q, torque), tx90l, tmp_path)
    weight = log.weight
    correlation = weight.cross_products[1] / np.sqrt(weight.weight_squares[1] * weight.torque_squares[1])
    assert correlation < -0.9
    require_joint_torques([log], tx90l)
