"""The uniform base under time stamps, against signals that are known between the samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexcal.data.time_base import fit_time_base, gaps, resample, uniform_blocks
from flexcal.errors import FlexcalError


def test_uniform_stamps_are_kept() -> None:
    t = 3.0 + np.arange(100) * 0.004
    base = fit_time_base(t)
    assert (base.start, base.samples, base.lost, base.resampled) == (3.0, 100, 0, False)
    assert base.time_step == 0.004
    values = np.arange(200.0).reshape(100, 2)
    assert resample(t, values, base) is values


def test_cubics_are_resampled_exactly(rng: np.random.Generator) -> None:
    t = np.arange(200) * 0.01 + rng.uniform(-0.003, 0.003, 200)
    base = fit_time_base(t)
    assert base.resampled
    at = base.start + base.time_step * np.arange(base.samples)
    values = np.stack([t**3 - t, np.ones_like(t)], axis=1)
    assert np.allclose(
        resample(t, values, base), np.stack([at**3 - at, np.ones_like(at)], axis=1), atol=1e-11
    )


def test_three_samples_are_joined_by_lines() -> None:
    t = np.array([0.0, 1.3, 2.0])
    base = fit_time_base(t)
    values = resample(t, 2 * t, base)
    assert np.allclose(values, 2 * (base.start + base.time_step * np.arange(3)))


def test_lost_sample_and_gap() -> None:
    t = np.array([0, 1, 2, 4, 5, 9, 10.0])
    assert gaps(t).tolist() == [4]
    base = fit_time_base(t[:5])
    assert (base.lost, base.samples, base.time_step) == (1, 6, 1.0)
    assert gaps(np.array([1.0])).size == 0


def test_one_stamp_is_too_few() -> None:
    with pytest.raises(FlexcalError, match="two samples"):
        fit_time_base(np.array([1.0]))


@settings(max_examples=100, deadline=None)
@given(
    st.integers(2, 300),
    st.integers(1, 80),
    st.floats(0, 0.3),
    st.lists(st.integers(1, 298), max_size=3, unique=True),
    st.integers(0, 2**32 - 1),
)
def test_blocks_lose_nothing(samples: int, size: int, jitter: float, holes: list[int], seed: int) -> None:
    """Whatever the blocks: a straight line stays one, time never runs back, gaps are the ones made, all time is there."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) + rng.uniform(-jitter, jitter, samples) * (jitter > 0.02)
    for hole in holes:
        t[hole:] += 7.0
    made = sum(hole < samples for hole in holes)
    if not np.median(np.diff(t[: max(size, 200)])) < 2:
        return  # mostly gaps
    blocks = [(t[i : i + size], np.stack([t, 2 * t], axis=1)[i : i + size]) for i in range(0, samples, size)]
    parts = list(uniform_blocks(iter(blocks)))
    time = np.concatenate([b.start + b.time_step * np.arange(b.samples) for b, _ in parts])
    values = np.concatenate([v for _, v in parts])
    assert np.allclose(values, np.stack([time, 2 * time], axis=1), rtol=0, atol=0.05)
    assert (np.diff(time) > 0).all()
    assert sum(b.gap > 0 for b, _ in parts) == made
    for moment in t:
        assert np.abs(time - moment).min() < 1.0 + jitter
