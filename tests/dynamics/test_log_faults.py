"""Logs in which a sensor lies are refused in one sentence; those that only look odd are not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from refusals import refused

from flexcal.data.recordings import Recording, write_recording
from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.signals import JointLog, Motion
from flexcal.model.robot import RobotModel
from flexcal.model.torques import torque_regressor

RATE = 200.0


@pytest.fixture(scope="module")
def recording(swing: Motion, tx40: RobotModel) -> Recording:
    """Ten seconds of motion with the torques that CAD's inertias take, velocities beside them, noise on all."""
    rng = np.random.default_rng(4)
    observation = Observation(tx40, ())
    regressor = torque_regressor(tx40, swing.q, swing.dq, swing.ddq)
    torque = regressor @ observation.values() + 0.2 * rng.normal(size=swing.q.shape)
    q = np.round(swing.q / 2.4e-5) * 2.4e-5
    return Recording(1 / RATE, q, torque, velocity=swing.dq + 0.01 * rng.normal(size=q.shape))


def held(recording: Recording) -> Recording:
    """Joint 2 gets no more than nine tenths of its largest torque."""
    torque = recording.torque.copy()
    limit = 0.9 * np.abs(torque[:, 1]).max()
    torque[:, 1] = np.clip(torque[:, 1], -limit, limit)
    return replace(recording, torque=torque)


def clipped(recording: Recording) -> Recording:
    """The encoder of joint 3 ends in the middle of its motion, and its drive derives the velocity from it."""
    q, velocity = recording.q.copy(), recording.velocity
    assert velocity is not None
    q[:, 2] = np.minimum(q[:, 2], np.quantile(q[:, 2], 0.6))
    return replace(recording, q=q, velocity=np.gradient(q, 1 / RATE, axis=0))


def rates(factor: float) -> Callable[[Recording], Recording]:
    """Velocities times a factor."""

    def change(recording: Recording) -> Recording:
        assert recording.velocity is not None
        return replace(recording, velocity=factor * recording.velocity)

    return change


def swapped(recording: Recording) -> Recording:
    """Velocities of the joints in another order."""
    assert recording.velocity is not None
    return replace(recording, velocity=recording.velocity[:, ::-1])


def unmeasured(recording: Recording) -> Recording:
    """Joint 5 has no torque sensor."""
    return replace(recording, torque=recording.torque * [1, 1, 1, 1, 0, 1])


def frozen(recording: Recording) -> Recording:
    """The encoder of joint 3 says nothing new, while its drive measures velocities."""
    q = recording.q.copy()
    q[:, 2] = q[0, 2]
    return replace(recording, q=q)


@pytest.mark.parametrize(
    ("fault", "refusal"),
    [
        (held, ["E-DYN-035", "log.parquet", "joint_2"]),
        (
            clipped,
            ["E-DYN-036", "joint_3"],
        ),
        (rates(180 / np.pi), ["E-DYN-037", "joint_1", "deg/s"]),
        (rates(-1.0), ["E-DYN-037", "joint_1", "their sign is the other one"]),
        (rates(0.0), ["E-DYN-037", "joint_1", "they are 0 times as large"]),
        (swapped, ["E-DYN-037", "joint_1"]),
        (unmeasured, ["E-DYN-034", "joint_5"]),
        (frozen, ["E-DYN-037", "joint_3"]),
    ],
)
def test_a_sensor_that_lies(
    fault: Callable[[Recording], Recording],
    refusal: list[str],
    recording: Recording,
    tx40: RobotModel,
    tmp_path: Path,
) -> None:
    path = tmp_path / "log.parquet"
    write_recording(path, fault(recording))
    with refused(*refusal):
        JointLog.read(path, tx40, 10.0, tmp_path)


def motors(recording: Recording, model: RobotModel) -> pl.DataFrame:
    """What the TX40 logs: q and τ through the inverses of the matrices that robot.yaml declares."""
    q_from, torque_from = (
        np.loadtxt(model.path.parent / name, delimiter=",")
        for name in ("joint_from_motor.csv", "joint_from_motor_torque.csv")
    )
    zeros = np.pi / 2 * np.array([0, -1, 1, 0, 0, 0])
    angles = np.linalg.solve(q_from, (recording.q - zeros).T)
    torques = np.linalg.solve(torque_from, recording.torque.T)
    columns = {f"motor_{k + 1}": angles[k] for k in range(6)} | {
        f"torque_{k + 1}": torques[k] for k in range(6)
    }
    return pl.DataFrame({"t": recording.time} | columns)


@pytest.mark.parametrize(("column", "code"), [("torque_5", "E-DYN-035"), ("motor_6", "E-DYN-036")])
def test_a_motor_that_drives_two_joints(
    column: str, code: str, recording: Recording, tx40: RobotModel, tmp_path: Path
) -> None:
    """Its limit is that of no joint: joint 5 feels the torque of motor 6 as well, joint 6 turns with motor 5."""
    table = motors(replace(recording, torque=20.0 * np.cos(recording.q)), tx40)
    limit = 0.6 * pl.col(column).abs().max()
    table.with_columns(pl.col(column).clip(-limit, limit)).write_parquet(tmp_path / "log.parquet")
    with refused(code, f"column {column}"):
        JointLog.read(tmp_path / "log.parquet", tx40, 10.0, tmp_path)


def test_an_encoder_that_ends_though_time_stamps_jitter(
    recording: Recording, tx40: RobotModel, tmp_path: Path
) -> None:
    """What is interpolated onto even instants overshoots the ends of its stay, and is there the same to rounding only."""
    time = recording.time + np.random.default_rng(6).uniform(-0.2, 0.2, len(recording)) / RATE
    q = np.stack([np.interp(time, recording.time, column) for column in recording.q.T], axis=1)
    write_recording(tmp_path / "log.csv", clipped(replace(recording, q=q, velocity=0 * q)))
    table = (
        pl.read_csv(tmp_path / "log.csv")
        .with_columns(pl.Series("t", time))
        .drop(f"dq{k}" for k in range(1, 7))
    )
    table.write_csv(tmp_path / "log.csv")
    with refused("E-DYN-036"):
        JointLog.read(tmp_path / "log.csv", tx40, 10.0, tmp_path)


def standing(recording: Recording) -> Recording:
    """Before it moves it rests a second at one end, with brakes on, which take the torque to zero."""
    assert recording.velocity is not None
    ramp = np.clip(np.arange(len(recording)) / RATE - 1.0, 0.0, 1.0) ** 2
    q = recording.q[0] + ramp[:, None] * (recording.q - recording.q[0])
    torque = np.where(ramp[:, None] > 0, recording.torque, 0.0)
    return replace(recording, q=q, torque=torque, velocity=np.gradient(q, 1 / RATE, axis=0))


def repeated(recording: Recording) -> Recording:
    """The drives send torques every tenth sample only."""
    return replace(recording, torque=recording.torque[np.arange(len(recording)) // 10 * 10])


def coarse(recording: Recording) -> Recording:
    """Encoders of 4096 counts a turn, and torques of whole newton metres."""
    count = 2 * np.pi / 4096
    return replace(recording, q=np.round(recording.q / count) * count, torque=np.round(recording.torque))


def late(recording: Recording) -> Recording:
    """Velocities come 25 ms late."""
    assert recording.velocity is not None
    return replace(recording, velocity=recording.velocity[np.maximum(np.arange(len(recording)) - 5, 0)])


def locked(recording: Recording) -> Recording:
    """Joint 2 never moves, and its drive makes velocities of the noise of its encoder."""
    rng = np.random.default_rng(3)
    q, velocity = recording.q.copy(), recording.velocity
    assert velocity is not None
    q[:, 1] = 0.3 + 1e-5 * rng.normal(size=len(q))
    velocity = velocity * [1, 0, 1, 1, 1, 1]
    velocity[:, 1] = 0.01 * rng.normal(size=len(q))
    return replace(recording, q=q, velocity=velocity)


@pytest.mark.parametrize("oddity", [lambda same: same, standing, repeated, coarse, late, locked])
def test_what_only_looks_odd(
    oddity: Callable[[Recording], Recording], recording: Recording, tx40: RobotModel, tmp_path: Path
) -> None:
    path = tmp_path / "log.parquet"
    write_recording(path, oddity(recording))
    assert JointLog.read(path, tx40, 10.0, tmp_path).span == (0.0, pytest.approx(recording.duration))
