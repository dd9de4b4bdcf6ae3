"""Logs in which a sensor lies are refused in one sentence; those that only look odd are not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexcal.data import Recording, write_recording
from flexcal.dynamics import Motion, Observation, log_blocks
from flexcal.errors import InputError
from flexcal.model import RobotModel, torque_regressor

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


def of_motors(recording: Recording) -> Recording:
    """Torques on the motors' side of a gear."""
    return replace(recording, torque=recording.torque / 45)


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        (held, r"log\.parquet: the torque of joint_2 stays at its extreme -?\d+\.?\d* for \d+ samples"),
        (
            clipped,
            r"the position of joint_3 runs into its extreme .* rad at full speed .* the encoder is clipped",
        ),
        (rates(180 / np.pi), r"velocities of joint_1 .* degrees a second: declare 'unit: deg/s'"),
        (rates(-1.0), "velocities of joint_1 .* their sign is the other one"),
        (swapped, "velocities of joint_1 are not those of its positions"),
        (
            of_motors,
            r"the torque of joint_2 follows only 2\.\d+% of what its weight asks for; .* torques of the motors",
        ),
    ],
)
def test_a_sensor_that_lies(
    fault: Callable[[Recording], Recording],
    sentence: str,
    recording: Recording,
    tx40: RobotModel,
    tmp_path: Path,
) -> None:
    path = tmp_path / "log.parquet"
    write_recording(path, fault(recording))
    with pytest.raises(InputError, match=sentence):
        list(log_blocks(path, tx40))


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


@pytest.mark.parametrize("oddity", [lambda same: same, standing, repeated, coarse, late])
def test_what_only_looks_odd(
    oddity: Callable[[Recording], Recording], recording: Recording, tx40: RobotModel, tmp_path: Path
) -> None:
    path = tmp_path / "log.parquet"
    write_recording(path, oddity(recording))
    assert sum(len(block) for block in log_blocks(path, tx40)) == len(recording)
