"""Standard deviations and intervals where errors hang together in time and between joints."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from flexcal.data import read_recording
from flexcal.data.filtering import Decimation
from flexcal.dynamics import (
    BaseParameters,
    Motion,
    Observation,
    Window,
    observe,
    weighted_least_squares,
)
from flexcal.dynamics.rows import rows

NOISE = np.array([3.0, 2.0, 1.0, 0.3, 0.2, 0.05])
RATE = 100.0


@pytest.fixture(scope="module")
def tour(observation: Observation, sines: Callable[[int, float], Motion]) -> Motion:
    """Eighty seconds of six joints on sums of sines, with the torques of the CAD robot and unit friction."""
    motion = sines(8000, RATE)
    columns = observation.columns(motion)
    torques = [truth(observation)[m] @ c for m, c in zip(observation.members, columns, strict=True)]
    return replace(motion, torque=np.stack(torques, axis=1))


def truth(observation: Observation) -> np.ndarray:
    values = observation.values()
    return np.where(values == 0, 1.0, values)


def coloured(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """First-order autoregressive noise of unit size with a time constant of 0.2 s, a half of it common to all joints."""
    decay = np.exp(-1 / (0.2 * RATE))
    white = rng.normal(size=(shape[0] + 200, shape[1])) + rng.normal(size=(shape[0] + 200, 1))
    return lfilter([np.sqrt((1 - decay**2) / 2)], [1, -decay], white, axis=0)[200:]


def inside(
    observation: Observation, base: BaseParameters, tour: Motion, runs: int
) -> tuple[np.ndarray, np.ndarray]:
    """For every run and base parameter, whether its 95 % interval holds the truth, and its error over its standard deviation."""
    rng = np.random.default_rng(11)
    held, scores = [], []
    names = dict(zip(observation.names, truth(observation), strict=True))
    for _ in range(runs):
        noisy = replace(tour, torque=tour.torque + NOISE * coloured(rng, tour.torque.shape))
        found = weighted_least_squares(observe(observation, base, [noisy], Decimation(2)))
        expected = found.regrouped(names)
        kept = base.found.kept_names
        intervals = [found.interval(name) or (np.nan, np.nan) for name in kept]
        held.append([low < expected[name] < high for name, (low, high) in zip(kept, intervals, strict=True)])
        scores.append([(found.values[n] - expected[n]) / (found.std(n) or np.nan) for n in kept])
    return np.array(held), np.array(scores)


def test_intervals_cover_in_coloured_noise(
    observation: Observation, base: BaseParameters, tour: Motion
) -> None:
    held, scores = inside(observation, base, tour, 16)
    assert 0.91 < held.mean() < 0.975
    assert np.sqrt(np.mean(scores**2)) == pytest.approx(1.0, abs=0.12)


@pytest.mark.slow
def test_intervals_cover_in_five_hundred_recordings(
    observation: Observation, base: BaseParameters, tour: Motion
) -> None:
    held, _ = inside(observation, base, tour, 500)
    each = held.mean(axis=0)
    print(f"pooled {held.mean():.3f}, each {each.min():.3f} to {each.max():.3f}")
    assert 0.93 < held.mean() < 0.97
    assert each.min() > 0.89 and each.max() < 0.99


def test_it_is_the_block_bootstrap_of_a_real_recording(
    examples: Path, observation: Observation, base: BaseParameters
) -> None:
    """Blocks of rows (0.3 s, all joints together) drawn with replacement and fitted anew by dense least squares."""
    motion = Motion.of(read_recording(examples / "tx40" / "exciting.parquet", observation.model), 100.0)
    data = observe(observation, base, [motion], Decimation(100))
    found = weighted_least_squares(data)
    reported = np.array([found.std(name) for name in base.found.kept_names], dtype=float)
    parts = [part.where(~part.still) for part in rows(observation, motion, Decimation(100), Window())]
    sigma = [sigma for sigma, _ in data.noise()]
    wide = np.zeros((sum(map(len, parts)), 6, len(observation.names)))
    for joint, members in enumerate(observation.members):
        wide[:, joint, members] = np.hstack([part.columns[joint] for part in parts]).T / sigma[joint]
    right = np.hstack([part.torque for part in parts]).T / sigma - wide @ observation.values()
    wide = wide[:, :, list(base.found.kept)]
    scale = 1 / np.linalg.norm(wide, axis=(0, 1))
    rng, length, drawn = np.random.default_rng(5), 15, []
    for _ in range(200):
        starts = rng.integers(0, len(wide) - length + 1, len(wide) // length)
        at = (starts[:, None] + np.arange(length)).ravel()
        drawn.append(
            scale
            * np.linalg.lstsq((wide[at] * scale).reshape(-1, len(scale)), right[at].ravel(), rcond=None)[0]
        )
    ratio = reported / np.std(drawn, axis=0)
    assert np.median(ratio) == pytest.approx(1.0, abs=0.1)
    assert np.mean((ratio > 0.8) & (ratio < 1.25)) > 0.85


def test_a_joint_that_moves_once_is_not_certain(
    observation: Observation, base: BaseParameters, tour: Motion
) -> None:
    """One batch alone determines its friction and leaves no residual there: the standard deviation is then that of independent errors."""
    rng = np.random.default_rng(2)
    moves = (np.arange(8000) // 60 == 50)[:, None] | (np.arange(6) < 5)
    still = replace(tour, dq=tour.dq * moves, ddq=tour.ddq * moves)
    columns = observation.columns(still)
    torques = [truth(observation)[m] @ c for m, c in zip(observation.members, columns, strict=True)]
    noisy = replace(still, torque=np.stack(torques, axis=1) + NOISE * rng.normal(size=(8000, 6)))
    found = weighted_least_squares(observe(observation, base, [noisy], Decimation(1)))
    viscous, speed = found.std("joint_6.viscous"), still.dq[moves[:, 5], 5]
    assert viscous is not None and viscous > 0.5 * NOISE[5] / np.linalg.norm(speed - speed.mean())
