"""The uniform base under time stamps, against signals that are known between the samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from flexcal.data.recordings import TimeBase, TimeSummary, uniform_blocks
from flexcal.data.recordings.irregular_interpolation import interpolated
from flexcal.data.recordings.time_base import sampling_gaps

FILL = 0.02
SAMPLES = 12_000


def sines(t: np.ndarray) -> np.ndarray:
    """Positions (N, 3) below 3 Hz, rad."""
    frequency = np.array([0.1, 0.35, 0.8, 1.7, 2.6])
    amplitude = np.array([[0.4, 0.2, 0.1, 0.06, 0.04], [0.1, 0.3, 0.2, 0.1, 0.02], [0.5, 0.1, 0.1, 0.0, 0.1]])
    phase = np.arange(15.0).reshape(3, 5)
    return np.sum(amplitude * np.sin(2 * np.pi * frequency * t[:, None, None] + phase), axis=-1)


def on_base(
    t: np.ndarray, q: np.ndarray, fill: float = FILL, size: int = 2_500
) -> tuple[np.ndarray, np.ndarray, list[TimeBase]]:
    """Times and positions that come out of blocks, and their bases."""
    blocks = ((t[i : i + size], q[i : i + size]) for i in range(0, len(t), size))
    parts = list(uniform_blocks(blocks, positions=q.shape[1], fill=fill))
    times = [base.start + base.time_step * np.arange(base.samples) for base, _ in parts]
    return np.concatenate(times), np.concatenate([values for _, values in parts]), [base for base, _ in parts]


def said(bases: list[TimeBase]) -> str:
    summary = TimeSummary()
    for base in bases:
        summary.add(base)
    return summary.sentence


def stamps(kind: str, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    even = np.arange(SAMPLES) / 1000
    return {
        "0.7 to 9 ms": np.cumsum(rng.uniform(0.7e-3, 9e-3, SAMPLES)),
        "some late": np.cumsum(
            np.where(rng.random(SAMPLES) < 0.05, 9e-3, rng.uniform(0.7e-3, 1.3e-3, SAMPLES))
        ),
        "jitter of 0.7 ms": np.sort(even + rng.normal(0, 0.7e-3, SAMPLES)),
        "jitter of 9 ms": np.sort(even + rng.uniform(-9e-3, 9e-3, SAMPLES)),
        "lost": np.delete(even, rng.choice(np.arange(1, SAMPLES - 1), SAMPLES // 10, replace=False)),
        "a slow clock": even * 1.00002,
        "a wandering clock": even + 2e-4 * np.sin(even),
    }[kind]


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    "kind",
    [
        "0.7 to 9 ms",
        "some late",
        "jitter of 0.7 ms",
        "jitter of 9 ms",
        "lost",
        "a slow clock",
        "a wandering clock",
    ],
)
def test_true_times_of_sampling_without_drift_or_extrapolation(kind: str, seed: int) -> None:
    t = stamps(kind, seed)
    time, q, bases = on_base(t, sines(t))
    np.testing.assert_allclose(q, sines(time), rtol=0, atol=1e-6)
    assert time[0] >= t[0] - 1e-9 and time[-1] <= t[-1] + 1e-9
    np.testing.assert_allclose(np.diff(time), bases[0].time_step, rtol=1e-9)
    assert time[-1] - time[0] > 0.999 * (t[-1] - t[0])
    assert not any(base.even for base in bases)


@pytest.mark.parametrize("jitter", [0.0, 3e-4])
def test_gaps_are_not_bridged(jitter: float) -> None:
    rng = np.random.default_rng(3)
    t = np.arange(SAMPLES) / 1000 + rng.uniform(-jitter, jitter, SAMPLES)
    t[5_000:] += 0.7
    t[9_000:] += 30.0
    time, q, bases = on_base(t, sines(t))
    np.testing.assert_allclose(q, sines(time), rtol=0, atol=1e-6)
    assert [base.gap for base in bases if base.gap] == [
        pytest.approx(0.7, abs=2e-3),
        pytest.approx(30.0, abs=2e-3),
    ]
    inside = [(t[0], t[4_999]), (t[5_000], t[8_999]), (t[9_000], t[-1])]
    assert all(any(a - 1e-9 <= x <= b + 1e-9 for a, b in inside) for x in time[:: len(time) // 500])
    assert np.sum(np.diff(time) > 0.5) == 2
    assert "divided at 2 gaps, the longest of 30 s" in said(bases)


def test_gaps_are_longer_than_what_is_filled() -> None:
    t = np.delete(np.arange(3_000) / 1000, np.concatenate([range(500, 515), range(1_000, 1_030)]))
    time, q, bases = on_base(t, sines(t))
    assert sum(base.gap > 0 for base in bases) == 1
    assert sum(base.lost for base in bases) == 15
    np.testing.assert_allclose(q, sines(time), rtol=0, atol=1e-6)
    assert said(bases).startswith("15 lost samples interpolated; divided at 1 gap of 0.031 s")


@pytest.mark.parametrize("kind", ["rounded to ms", "late by chance", "in bursts", "rounded, at 3 kHz"])
def test_stamps_that_scatter_about_even_sampling(kind: str) -> None:
    """Only their constant delay is left: positions are as smooth as they were."""
    rng, k = np.random.default_rng(4), np.arange(SAMPLES)
    step = 1e-3 / 3 if "3 kHz" in kind else 1.0003e-3 if "ms" in kind else 1e-3
    t = step * k
    seen = {
        "rounded to ms": np.round(t, 3),
        "late by chance": np.maximum.accumulate(t + rng.exponential(2e-3, SAMPLES)) + 1e-9 * k,
        "in bursts": 0.01 * (k // 10) + 2e-5 * (k % 10),
        "rounded, at 3 kHz": np.floor(1000 * t + 1e-9) / 1000,
    }[kind]
    q = sines(t) + 1e-7 * rng.normal(size=(SAMPLES, 3))
    time, found, bases = on_base(seen, q)
    assert all(base.even for base in bases) and "scatter" in said(bases)
    assert "0 ms" not in said(bases)  # the even times, which replace the stamps, scatter by nothing
    assert bases[0].time_step == pytest.approx(step, rel=5e-4)
    some = slice(None, None, 30)
    errors = [np.abs(sines(time[some] - d) - found[some]).max() for d in np.linspace(-0.012, 0.012, 301)]
    assert min(errors) < 1e-3
    np.testing.assert_allclose(np.diff(found, 2, axis=0), np.diff(sines(time), 2, axis=0), atol=3e-5)


def test_rows_are_sorted_merged_and_repeated_ones_left_out() -> None:
    rng, t = np.random.default_rng(5), np.arange(4_000) / 1000
    order = np.arange(4_000)
    for k in rng.choice(np.arange(300, 3_900, 5), 40, replace=False):
        order[[k, k + 2]] = order[[k + 2, k]]
    time, q, bases = on_base(t[order], sines(t[order]))
    np.testing.assert_allclose(q, sines(t), atol=1e-12)
    assert len(time) == 4_000 and said(bases).endswith("rows out of order by their time stamps, and sorted")

    source = np.arange(4_000)
    stale = rng.choice(np.arange(1, 3_999, 2), 200, replace=False)
    source[stale] -= 1
    time, q, bases = on_base(t, sines(t[source]))
    np.testing.assert_allclose(q, sines(time), atol=1e-9)
    assert abs(sum(base.repeated for base in bases) - 200) <= 3
    assert "that repeat the one before while the robot moves left out" in said(bases)

    held = sines(t[4 * (np.arange(4_000) // 4)])
    time, q, bases = on_base(t, held)
    assert bases[0].time_step == 0.004
    np.testing.assert_allclose(q, sines(time), atol=1e-9)

    twice = np.sort(np.concatenate([t, t[stale]]))
    noisy = sines(twice) + np.tile([[1e-6], [-1e-6]], (2_100, 1))
    time, q, bases = on_base(twice, noisy)
    assert sum(base.merged for base in bases) == 200
    np.testing.assert_allclose(q, sines(time), atol=2e-6)


def test_a_robot_at_rest_repeats_nothing() -> None:
    t = np.arange(2_000) / 1000
    q = np.where(t < 1.0, 0.5, 0.5 + (t - 1.0) ** 3)[:, None]
    time, found, bases = on_base(t, q)
    assert len(time) == 2_000 and not any(base.resampled for base in bases)
    np.testing.assert_array_equal(found, q)


def test_uniform_stamps_are_kept() -> None:
    t = 3.0 + np.arange(100) * 0.004
    values = np.arange(200.0).reshape(100, 2)
    _, found, (base,) = on_base(t, values)
    assert (base.start, base.samples, base.lost, base.resampled) == (3.0, 100, 0, False)
    assert base.time_step == 0.004 and not said([base])
    np.testing.assert_array_equal(found, values)


def test_polynomials_of_fifth_degree_are_exact(rng: np.random.Generator) -> None:
    t = np.sort(rng.uniform(0, 1, 200))
    at = np.linspace(t[0], t[-1], 333)
    values = np.stack([t**5 - t**4, np.ones_like(t)], axis=1)
    expected = np.stack([at**5 - at**4, np.ones_like(at)], axis=1)
    np.testing.assert_allclose(interpolated(t, values, at), expected, atol=1e-12)


def test_close_samples_beside_a_long_step_amplify_no_noise(rng: np.random.Generator) -> None:
    """Two samples a microsecond apart on either side of 9 ms."""
    t = np.sort(np.concatenate([np.arange(0, 1, 9e-3), np.arange(0, 1, 9e-3) + 1e-6]))
    at = np.linspace(t[0], t[-1], 4_000)
    noise = interpolated(t, rng.choice([-1.0, 1.0], (t.size, 50)), at)
    assert np.abs(noise).max() < 6.0
    inner = (at > 0.05) & (at < 0.95)
    assert np.sqrt(np.mean(noise[inner] ** 2)) < 1.1


def test_three_samples() -> None:
    t = np.array([0.0, 1.3, 2.0])
    time, values, _ = on_base(t, 2 * t[:, None])
    np.testing.assert_allclose(values[:, 0], 2 * time)


def test_lost_sample_and_gap() -> None:
    t = np.array([0, 1, 2, 4, 5, 9, 10.0])
    assert sampling_gaps(t).tolist() == [4]
    _, _, (base,) = on_base(t[:5], t[:5, None])
    assert (base.lost, base.samples, base.time_step) == (1, 6, 1.0)
    assert sampling_gaps(np.array([1.0])).size == 0


def test_one_stamp_is_too_few() -> None:
    with refused("E-LOG-022"):
        on_base(np.array([1.0]), np.zeros((1, 1)))


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
    time, values, bases = on_base(t, np.stack([t, 2 * t], axis=1), fill=0.0, size=size)
    np.testing.assert_allclose(values, np.stack([time, 2 * time], axis=1), rtol=0, atol=0.05)
    assert (np.diff(time) > 0).all()
    assert sum(base.gap > 0 for base in bases) == made
    for moment in t:
        assert np.abs(time - moment).min() < 1.0 + jitter
