"""Maximum likelihood of periodic motion: exact without noise, true intervals with coloured noise, four periods or more."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from over_seeds import over_seeds
from recovery import NOISE, covered, driven, errors, recorded
from refusals import refused

from flexcal.data.recordings import Decimation
from flexcal.dynamics.estimators import maximum_likelihood, weighted_least_squares
from flexcal.dynamics.friction import Presliding, WarmUp
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import assemble_regression
from flexcal.dynamics.signals import Motion, RepeatedMotion, Window
from flexcal.estimation import Estimate
from flexcal.model.robot import RobotModel

PERIOD = 1000


@pytest.fixture(scope="module")
def clean(observation: Observation, truth: np.ndarray, sines: Callable[[int, float], Motion]) -> Motion:
    """Five periods of ten seconds at 100 Hz."""
    return driven(observation, sines(5 * PERIOD, 100.0), truth)


def likeliest(observation: Observation, base: BaseParameters, *motions: Motion) -> tuple[Estimate, Estimate]:
    """And weighted least squares."""
    data = assemble_regression(observation, base, motions, Decimation(1))
    return maximum_likelihood(data, recorded(observation, base, *motions)), weighted_least_squares(data)


def coloured(shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """Of variance one, holding for a fifth of a second."""
    from scipy.signal import lfilter

    decay = np.exp(-0.05)
    white = rng.standard_normal((shape[0] + 300, shape[1]))
    return np.sqrt(1 - decay**2) * lfilter([1.0], [1.0, -decay], white, axis=0)[300:]


def spoilt(motion: Motion, acceleration: float, rng: np.random.Generator) -> Motion:
    """Coloured noise of the torques, and white noise of the accelerations."""
    torque = motion.torque + NOISE * coloured(motion.torque.shape, rng)
    return replace(motion, torque=torque, ddq=motion.ddq + acceleration * rng.normal(size=motion.ddq.shape))


def test_without_noise_the_truth_comes_back(
    observation: Observation, base: BaseParameters, clean: Motion, truth: np.ndarray
) -> None:
    found, _ = likeliest(observation, base, clean)
    assert found.rank == 61
    assert max(map(abs, errors(found, observation, truth).values())) < 1e-8


def test_friction_that_depends_on_the_past_comes_back(
    tx40: RobotModel, sines: Callable[[int, float], Motion]
) -> None:
    """Grease that warms up from period to period, and presliding that begins at rest with the recording."""
    observation = Observation(tx40, (*CLASSIC, WarmUp(20.0), Presliding((0.02,) * 6)))
    truth = observation.values() + np.random.default_rng(5).uniform(0.1, 1.0, len(observation.names))
    motion = driven(observation, sines(4 * PERIOD, 100.0), truth)
    found, _ = likeliest(observation, BaseParameters.of(observation), motion)
    assert found.rank == 73
    assert max(map(abs, errors(found, observation, truth).values())) < 1e-6


@pytest.mark.statistical
@pytest.mark.parametrize(("acceleration", "gain"), [(0.0, 0.95), (0.5, 0.75)])
def test_intervals_cover_where_noise_is_coloured(
    acceleration: float,
    gain: float,
    observation: Observation,
    base: BaseParameters,
    clean: Motion,
    truth: np.ndarray,
) -> None:
    """Nearer to the truth than weighted least squares, the more so where the motion is noisy too."""
    inside, ratio = scatter(observation, base, clean, truth, acceleration, 4)
    assert 0.9 < inside < 0.99
    assert ratio < gain


@pytest.mark.slow
@pytest.mark.parametrize("acceleration", [0.0, 0.5])
def test_intervals_cover_in_many_recordings(
    acceleration: float,
    observation: Observation,
    base: BaseParameters,
    clean: Motion,
    truth: np.ndarray,
) -> None:
    inside, _ = scatter(observation, base, clean, truth, acceleration, 50)
    print(f"{100 * inside:.1f} % of intervals")
    assert 0.93 < inside < 0.98


def scatter(
    observation: Observation,
    base: BaseParameters,
    clean: Motion,
    truth: np.ndarray,
    acceleration: float,
    recordings: int,
) -> tuple[float, float]:
    """Share of the 95 % intervals of 61 parameters that hold the truth, and the median error over that of weighted least squares."""
    found = over_seeds(of_one_recording, range(recordings), observation, base, clean, truth, acceleration)
    inside, ratios = zip(*found, strict=True)
    return float(np.mean(inside)), float(np.median(ratios))


def of_one_recording(
    seed: int,
    observation: Observation,
    base: BaseParameters,
    clean: Motion,
    truth: np.ndarray,
    acceleration: float,
) -> tuple[np.ndarray, list[float]]:
    rng = np.random.default_rng([20150917, seed])
    found, other = likeliest(observation, base, spoilt(clean, acceleration, rng))
    missed, plain = errors(found, observation, truth), errors(other, observation, truth)
    return covered(found, missed), [abs(missed[name] / plain[name]) for name in missed]


def test_the_period_is_found_in_the_motion(clean: Motion, rng: np.random.Generator) -> None:
    noisy = replace(clean, q=clean.q + 1e-3 * rng.normal(size=clean.q.shape))
    assert [len(p) for p in RepeatedMotion.of(noisy, Window()).periods] == [PERIOD] * 5
    assert len(RepeatedMotion.of(noisy, Window(start=5.0, end=47.0)).periods) == 4


def test_rest_before_and_after_is_no_period(rng: np.random.Generator) -> None:
    """Controllers hold the robot for seconds around what it was told: four periods are four."""
    time, rate = np.arange(5200) / 100.0, 2 * np.pi / 10
    phase = rate * np.clip(time - 5.0, 0.0, 40.0)[:, None]
    lines = np.array([1, 2, 3, 4, 5, 6])
    moves = (phase > 0) & (phase < 8 * np.pi)
    q = 1 - np.cos(lines * phase)
    dq = moves * rate * lines * np.sin(lines * phase)
    motion = Motion(time, q + 1e-5 * rng.normal(size=q.shape), dq, 0 * q, 0 * q)
    periods = RepeatedMotion.of(motion, Window()).periods
    assert [len(p) for p in periods] == [PERIOD] * 4
    assert periods[0].time[0] == pytest.approx(5.0, abs=0.06)


def test_what_cannot_tell_its_noise_is_refused(
    observation: Observation, base: BaseParameters, clean: Motion, swing: Motion, rng: np.random.Generator
) -> None:
    with refused("E-DYN-041", "shows 3 whole periods"):
        likeliest(observation, base, clean.part(0, 4 * PERIOD - 1))
    with refused("E-DYN-041", "contains no periodic motion"):
        likeliest(observation, base, replace(swing, torque=rng.normal(size=swing.torque.shape)))
    walk = np.cumsum(rng.normal(size=clean.q.shape), axis=0)
    with refused("E-DYN-041", "contains no periodic motion"):
        RepeatedMotion.of(replace(clean, q=walk), Window())


def test_a_motion_larger_than_the_memory_is_refused_beforehand(
    observation: Observation, base: BaseParameters, clean: Motion, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("flexcal.dynamics.estimators.periodic_likelihood.physical_memory", lambda: 500_000)
    with refused("E-DYN-009", "0.0", "5000", "0.0"):
        likeliest(observation, base, clean)
