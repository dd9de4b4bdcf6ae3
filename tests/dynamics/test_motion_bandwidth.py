"""The bandwidth of a motion, known from how it was made."""

import numpy as np
import pytest

from flexcal.data.recordings import Decimation, Recording
from flexcal.dynamics.signals import motion_bandwidth

STEP = 1 / 400


def recordings(q: np.ndarray, length: int) -> list[Recording]:
    return [
        Recording(STEP, q[a : a + length], np.zeros_like(q[a : a + length])) for a in range(0, len(q), length)
    ]


@pytest.mark.parametrize(("length", "noise"), [(24_000, 0.0), (1_000, 0.0), (1_000, 1e-4)])
def test_it_is_that_of_the_velocities(length: int, noise: float) -> None:
    """Two sines whose velocities are alike: a hundredth of the power of the second is above none of the first."""
    time = STEP * np.arange(24_000)
    slow, fast = np.sin(2 * np.pi * 0.5 * time) / 0.5, np.sin(2 * np.pi * 4.0 * time) / 4.0
    q = np.stack([slow + fast, 0.1 * slow, 0 * slow], axis=1)
    q = q + noise * np.random.default_rng(1).normal(size=q.shape)
    found = motion_bandwidth(recordings(q, length))
    assert found.frequency_hz == pytest.approx(4.0, abs=0.3)
    assert found.rate_hz == pytest.approx(400.0)


def test_standstill_has_none() -> None:
    assert motion_bandwidth(recordings(np.full((900, 2), 0.3), 100)).frequency_hz == 0.0


def test_the_nearest_decimation_below() -> None:
    assert [Decimation.near(f).factor for f in (0.3, 1.9, 11.0, 13.9, 97.0, 100.0)] == [1, 1, 10, 12, 96, 100]
