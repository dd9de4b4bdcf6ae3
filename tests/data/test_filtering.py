"""Filters: no phase, the same in blocks as in one go, and what they pass and stop."""

from itertools import pairwise

import numpy as np
import pytest
from refusals import refused
from scipy.signal import firwin

from flexcal.data.recordings import Decimation, DecimationStream

STEP = 1e-3
TIME = STEP * np.arange(4000)


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
    assert np.abs(decimation.apply(np.sin(2 * np.pi * 130 * TIME)[None])).max() < 1e-2


@pytest.mark.parametrize(("factor", "refusal"), [(0, ["E-LOG-001"]), (26, ["E-LOG-002", "10"])])
def test_factors_that_do_not_work(factor: int, refusal: list[str]) -> None:
    with refused(*refusal):
        Decimation(factor)


def test_the_filter_is_the_window_method(rng: np.random.Generator) -> None:
    noise = rng.normal(size=(2, 500))
    taps = firwin(81, 1 / 4, window="hamming")
    expected = np.stack([np.convolve(row, taps, mode="valid")[::4] for row in noise])
    np.testing.assert_allclose(Decimation(4).apply(noise), expected, atol=1e-13)


@pytest.mark.parametrize("factor", [1, 6, 60])
def test_a_stream_gives_the_whole(factor: int, rng: np.random.Generator) -> None:
    noise = rng.normal(size=(3, 3000))
    stream = DecimationStream(Decimation(factor))
    cuts = np.r_[0, np.sort(rng.choice(3000, 40, replace=False)), 3000]
    parts = [stream.push(noise[:, a:b]) for a, b in pairwise(cuts)]
    np.testing.assert_allclose(np.hstack(parts), Decimation(factor).apply(noise), atol=1e-14)
