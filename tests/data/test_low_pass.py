"""The zero-phase low-pass against SciPy's recursion, and its finite length."""

import numpy as np
import pytest
from refusals import refused
from scipy.signal import butter, sosfiltfilt

from flexcal.data.recordings import LowPass

STEP = 1e-3
TIME = STEP * np.arange(4000)


def extended(low_pass: LowPass, values: np.ndarray) -> np.ndarray:
    return np.vstack([low_pass.before(values), values, low_pass.before(values[::-1])[::-1]])


@pytest.mark.parametrize("cutoff", [3.0, 50.0, 300.0])
def test_it_is_butterworth_forwards_and_backwards(cutoff: float, rng: np.random.Generator) -> None:
    low_pass = LowPass(STEP, cutoff)
    noise = rng.normal(size=(12 * low_pass.support, 2))
    sections = butter(4, cutoff, fs=1 / STEP, output="sos")
    expected = sosfiltfilt(sections, noise, axis=0, padlen=0)
    inside = slice(3 * low_pass.support, -3 * low_pass.support)
    np.testing.assert_allclose(
        low_pass.apply(extended(low_pass, noise))[inside], expected[inside], atol=1e-10
    )


def test_slow_passes_without_phase_and_fast_does_not() -> None:
    slow, fast = np.sin(2 * np.pi * 2 * TIME), np.sin(2 * np.pi * 200 * TIME)
    low_pass = LowPass(STEP, 50.0)
    found = low_pass.apply(extended(low_pass, (slow + fast)[:, None]))[:, 0]
    assert found.shape == TIME.shape
    assert np.abs(found - slow)[200:-200].max() < 1e-4


def test_the_cut_off_halves() -> None:
    wave = np.cos(2 * np.pi * 50 * TIME)[:, None]
    assert np.abs(LowPass(STEP, 50.0).apply(wave)).max() == pytest.approx(0.5, abs=1e-9)


def test_parts_that_overlap_give_the_whole(rng: np.random.Generator) -> None:
    noise = rng.normal(size=(60_000, 2))
    low_pass = LowPass(STEP, 20.0)
    whole, cut = low_pass.apply(noise), 41_234
    parts = [low_pass.apply(noise[: cut + 2 * low_pass.support]), low_pass.apply(noise[cut:])]
    np.testing.assert_allclose(np.vstack(parts), whole, atol=1e-13)


def test_what_cannot_be_filtered_is_refused() -> None:
    with refused("E-LOG-020"):
        LowPass(STEP, 600.0)
    with refused("E-LOG-021"):
        LowPass(STEP, 10.0).before(TIME[:100, None])
