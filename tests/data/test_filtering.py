"""Filters: no phase, the same in blocks as in one go, and what they pass and stop."""

import numpy as np
import pytest

from flexcal.data.filtering import Decimation, central_difference, low_pass
from flexcal.errors import FlexcalError

STEP = 1e-3
TIME = STEP * np.arange(4000)


def test_slow_passes_without_phase_and_fast_does_not() -> None:
    slow, fast = np.sin(2 * np.pi * 2 * TIME), np.sin(2 * np.pi * 200 * TIME)
    found = low_pass(slow + fast, STEP, 50.0)
    assert np.abs(found - slow)[200:-200].max() < 1e-4


def test_the_cut_off_halves() -> None:
    wave = np.cos(2 * np.pi * 50 * TIME)
    assert np.abs(low_pass(wave, STEP, 50.0))[500:-500].max() == pytest.approx(0.5, abs=1e-3)


def test_derivatives_are_in_phase() -> None:
    found = central_difference(np.sin(5 * TIME), STEP)
    assert np.abs(found - 5 * np.cos(5 * TIME))[1:-1].max() < 5 * 5**2 * STEP**2


@pytest.mark.parametrize("factor", [1, 4, 10, 100])
def test_decimation_keeps_what_is_slow_where_it_was(factor: int) -> None:
    decimation = Decimation(factor)
    wave = np.stack([np.cos(2 * np.pi * 0.3 * TIME), np.ones_like(TIME)])
    expected = wave[:, decimation.support :][:, ::factor]
    found = decimation.apply(wave)
    assert np.abs(found - expected[:, : found.shape[1]]).max() < 5e-3
    assert found.shape[1] == len(range(decimation.support, len(TIME) - decimation.support, factor))


def test_blocks_that_overlap_give_the_whole(rng: np.random.Generator) -> None:
    decimation = Decimation(20)
    noise = rng.normal(size=(3, 4000))
    whole = decimation.apply(noise)
    cut = 20 * 80
    support = decimation.support
    parts = [decimation.apply(noise[:, : cut + 2 * support]), decimation.apply(noise[:, cut:])]
    joined = np.concatenate(parts, axis=1)
    np.testing.assert_allclose(joined, whole, atol=1e-14)


def test_what_aliases_is_stopped() -> None:
    decimation = Decimation(10)
    assert np.abs(decimation.apply(np.sin(2 * np.pi * 130 * TIME))).max() < 1e-2


@pytest.mark.parametrize(("factor", "message"), [(0, "must be 1 or more"), (26, "prime factor above 10")])
def test_factors_that_do_not_work(factor: int, message: str) -> None:
    with pytest.raises(FlexcalError, match=message):
        Decimation(factor)


def test_a_cut_off_above_half_the_rate_is_refused() -> None:
    with pytest.raises(FlexcalError, match="half the sampling rate"):
        low_pass(TIME, STEP, 600.0)
    with pytest.raises(FlexcalError, match="too few"):
        low_pass(TIME[:100], STEP, 10.0)
