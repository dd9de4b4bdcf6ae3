"""The TX40 as it was published: with the faults of the published treatment made on purpose, the published values come back."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, decimate, filtfilt

from flexcal.data.recordings import read_recording
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel

RATE, BORDER = 5000.0, 20
SLOW = np.array([0.05009095, 0.05009095, 0.07504916, 0.0715585, 0.05585054, 0.12217305])
"""Rows of a joint slower than this, rad/s, were left out (figaroh-examples, TX40_config.yaml)."""


@pytest.fixture(scope="module")
def motion(tx40: RobotModel, examples: Path) -> Motion:
    """The low-pass that was called 100 Hz and is 25 Hz, a velocity half a sample late, and no acceleration of joint 6."""
    recording = read_recording(examples / "tx40" / "exciting.parquet", tx40)
    q = filtfilt(*butter(4, 25.0 / (RATE / 2)), recording.q, axis=0)[BORDER:-BORDER]
    dq = np.diff(q, axis=0) * RATE
    ddq = np.gradient(dq, 1 / RATE, axis=0)
    ddq[:, 5] = 0.0
    inner = slice(BORDER, -BORDER - 2)
    return Motion(recording.time[inner], q[:-2], dq[:-1], ddq[:-1], recording.torque[inner])


def twice_decimated(columns: np.ndarray) -> np.ndarray:
    for _ in range(2):
        columns = decimate(columns, 10, axis=-1)
    return columns


def test_with_its_faults_the_published_estimate_comes_back(tx40: RobotModel, motion: Motion) -> None:
    """Sixty values and standard deviations of weighted least squares, to the digits in which they were published.

    It takes a third fault. The differences had cost the motion two samples, the torques none, and the rows of all joints, one joint below
    the other, were taken apart as if there were as many of each as torques: every joint is two samples ahead of the joint before it.
    """
    observation = Observation(tx40, CLASSIC)
    names = observation.names
    kept = [
        i for i in BaseParameters.of(observation).identifiability.kept if names[i] != "joint_6.rotor_inertia"
    ]
    systems = []
    for joint, (columns, members) in enumerate(
        zip(observation.columns(motion), observation.column_indices, strict=True)
    ):
        torque = twice_decimated(motion.torque[:, joint])
        wide = np.zeros((len(names), len(torque)))
        wide[members] = twice_decimated(columns[:, 2 * joint :])
        moves = np.abs(wide[names.index(f"joint_{joint + 1}.viscous")]) >= SLOW[joint]
        systems.append((wide[kept][:, moves].T, torque[moves]))

    def solved(noise: list[float]) -> tuple[np.ndarray, np.ndarray]:
        w = np.vstack([w / s for (w, _), s in zip(systems, noise, strict=True)])
        y = np.concatenate([y / s for (_, y), s in zip(systems, noise, strict=True)])
        return np.linalg.lstsq(w, y, rcond=None)[0], np.sqrt(np.diag(np.linalg.inv(w.T @ w)))

    plain, _ = solved([1.0] * 6)
    weighted, std = solved([float(np.linalg.norm(y - w @ plain)) / len(y) ** 0.5 for w, y in systems])
    lines = (Path(__file__).parents[1] / "cli" / "tx40_published.csv").read_text().splitlines()[2:]
    published = {name: (float(value), float(size)) for name, value, size in (x.split(",") for x in lines)}
    assert set(published) == {names[i] for i in kept}
    expected = np.array([published[names[i]] for i in kept])
    off = np.abs(weighted - expected[:, 0]) / expected[:, 1]
    assert np.max(off) < 0.01
    np.testing.assert_allclose(std, expected[:, 1], rtol=0.005)
