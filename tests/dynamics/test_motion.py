"""Filtered motion: the same wherever a log is cut into blocks, and that of the whole."""

from itertools import pairwise

import numpy as np
import pytest
from refusals import refused
from scipy.signal import butter, savgol_filter, sosfiltfilt

from flexcal.data.recordings import Recording
from flexcal.dynamics.signals import Motion, filtered_motion

STEP, CUTOFF = 1 / 500, 20.0


@pytest.fixture
def recording(rng: np.random.Generator) -> Recording:
    time = STEP * np.arange(6000)
    q = np.stack([np.sin(2 * np.pi * f * time) for f in (0.3, 1.1)], axis=1) + 1e-5 * rng.normal(
        size=(6000, 2)
    )
    return Recording(time_step=STEP, q=q, torque=rng.normal(size=(6000, 2)), start=3.0)


def test_it_is_the_filtered_recording(recording: Recording) -> None:
    motion = Motion.of(recording, CUTOFF)
    border = 75
    assert len(motion) == 6000 - 2 * border
    np.testing.assert_allclose(motion.time, recording.time[border:-border], rtol=1e-14)
    np.testing.assert_array_equal(motion.torque, recording.torque[border:-border])
    q = sosfiltfilt(butter(4, CUTOFF, fs=1 / STEP, output="sos"), recording.q, axis=0, padlen=3000)
    inside = slice(600, -600)
    np.testing.assert_allclose(motion.q[inside], q[border:-border][inside], atol=1e-10)
    dq, ddq = (savgol_filter(q, 5, 4, deriv=order, delta=STEP, axis=0) for order in (1, 2))
    moves = (np.abs(dq) > 1e-3) | (np.abs(ddq) > 0.1)
    np.testing.assert_allclose(motion.dq[inside], (dq * moves)[border:-border][inside], atol=1e-9)
    np.testing.assert_allclose(motion.ddq[inside], ddq[border:-border][inside], atol=1e-7)


def test_without_noise_it_is_the_motion_from_end_to_end() -> None:
    """Sampling takes less than 1e-6 of it, the filter's transients less than 1e-3 at either end."""
    time, omega = STEP * np.arange(6000), 2 * np.pi * np.array([0.3, 1.1])
    angle = time[:, None] * omega + 0.4
    motion = Motion.of(Recording(STEP, np.sin(angle), 0 * angle), CUTOFF)
    at = np.round(motion.time / STEP).astype(int)
    for found, order in ((motion.q, 0), (motion.dq, 1), (motion.ddq, 2)):
        missed = np.abs(found / omega**order - np.sin(angle[at] + order * np.pi / 2))
        assert missed.max() < 1e-3
        assert missed[600:-600].max() < 1e-6


def test_a_reversal_is_no_rest() -> None:
    """At the instant of a reversal the speed is small, and friction has its sign."""
    time = STEP * (np.arange(6000) + 0.01)
    motion = Motion.of(Recording(STEP, np.sin(2 * np.pi * time)[:, None], 0 * time[:, None]), CUTOFF)
    assert np.abs(motion.dq).min() < 1e-3
    assert motion.dq.all()


def test_blocks_give_the_whole(recording: Recording, rng: np.random.Generator) -> None:
    cuts = np.r_[0, 3, 200, np.sort(rng.choice(np.arange(300, 5990), 7, replace=False)), 5998, 6000]
    blocks = [
        Recording(STEP, recording.q[a:b], recording.torque[a:b], start=3.0 + a * STEP)
        for a, b in pairwise(cuts)
    ]
    parts, whole = Motion.joined(filtered_motion(blocks, CUTOFF)), Motion.of(recording, CUTOFF)
    rounding = 64 / 12 * 1e-15 / STEP**2  # of q, by the coefficients of the second difference
    tolerances = {"time": 1e-12, "q": 1e-14, "dq": 1e-12, "ddq": rounding, "torque": 0.0}
    for name, tolerance in tolerances.items():
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), rtol=0, atol=tolerance)


def test_noise_at_rest_has_no_direction(rng: np.random.Generator) -> None:
    """One joint moves for six seconds and rests for six, the other the other way round."""
    time = STEP * np.arange(6000)
    path = 0.5 * (1 - np.cos(np.pi * np.minimum(time, 6.0)))
    noise = 1e-6 * rng.normal(size=(6000, 2))
    motion = Motion.of(Recording(STEP, np.stack([path, path[::-1]], axis=1) + noise, 0 * noise), CUTOFF)
    rests = np.stack([motion.time > 6.1, motion.time < 5.9], axis=1)
    assert not motion.dq[rests].any()
    assert motion.ddq[rests].any()
    assert np.mean(motion.dq[~rests] != 0) > 0.95


def test_too_short_a_recording(recording: Recording) -> None:
    with refused("E-LOG-021", "20"):
        Motion.of(Recording(STEP, recording.q[:100], recording.torque[:100]), CUTOFF)
