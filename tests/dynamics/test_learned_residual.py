"""A learned residual torque: it finds what was put there, its intervals hold what is measured, and it learns nothing where nothing is."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from over_seeds import over_seeds
from recovery import driven, recorded
from refusals import refused
from scipy.signal import lfilter
from two_links import true_values, two_links

from flexcal.data.recordings import Decimation
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import RegressionData, experiment_system
from flexcal.dynamics.residual import (
    CrossValidatedErrors,
    GaussianProcess,
    LearnedResidual,
    learn_residual,
    residual_errors,
)
from flexcal.dynamics.signals import Motion, Window
from flexcal.estimation import Estimate

pytest.importorskip("sklearn", reason="scikit-learn (the extra 'learn') is not installed")

RATIO = 0.5
COUPLED = f"drives: {{coupling: [{{motor: elbow, joint: shoulder, ratio: {RATIO}}}]}}\n"
TRAIN, SAMPLES, RATE = 120, 168, 4.0
NOISE = np.array([0.3, 0.1])
"""Of the torques of shoulder and elbow, N m."""


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Observation:
    """Two links whose elbow motor turns with the shoulder too."""
    return Observation(two_links(tmp_path_factory.mktemp("arm"), COUPLED), CLASSIC)


def swings(arm: Observation, seed: int, samples: int) -> Motion:
    """Sums of sines that do not repeat, with the torques of the true parameters."""
    rng, time = np.random.default_rng(seed), np.arange(samples) / RATE
    rate = 2 * np.pi * np.array([0.11, 0.23, 0.37, 0.53])
    phase = rng.uniform(0, 2 * np.pi, (4, 2))
    size = np.array([[0.8], [0.5], [0.3], [0.2]])
    angle = time[:, None, None] * rate[:, None] + phase
    q, dq = np.sum(size * np.sin(angle), axis=1), np.sum(size * rate[:, None] * np.cos(angle), axis=1)
    ddq = -np.sum(size * rate[:, None] ** 2 * np.sin(angle), axis=1)
    return driven(arm, Motion(time, q, dq, ddq, np.zeros_like(q)), true_values(arm))


def with_extra(motion: Motion) -> Motion:
    """Ripple of the elbow's motor, of which the shoulder feels its share, and stiction of the shoulder."""
    ripple = 1.5 * np.sin(12 * (motion.q[:, 1] + RATIO * motion.q[:, 0]))
    bump = 6.0 * np.exp(-((motion.dq[:, 0] / 0.4) ** 2))
    return replace(motion, torque=motion.torque + np.stack([bump + RATIO * ripple, ripple], axis=1))


def learned(
    arm: Observation, motion: Motion, truth: np.ndarray | None = None
) -> tuple[LearnedResidual, CrossValidatedErrors, Estimate]:
    """From all rows of a motion, after weighted least squares, or with the true parameters (p,)."""
    base = BaseParameters.of(arm)
    systems = [experiment_system(arm, motion, Decimation(1), Window(), mask_standstill=True)]
    estimate = weighted_least_squares(RegressionData.of(arm, base, systems))
    if truth is not None:
        estimate = replace(estimate, parameters=estimate.parameters.with_coordinates(truth))
    return *learn_residual(recorded(arm, base, motion), systems, estimate), estimate


def errors(
    found: LearnedResidual, estimate: Estimate, arm: Observation, motion: Motion
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What is missed of the torques (N, 2) without and with what was learned, and the standard deviations (N, 2) said of the latter."""
    predicted = driven(arm, motion, estimate.parameters.coordinates()).torque
    added, std = found.torque(motion.q, motion.dq, predicted)
    return motion.torque - predicted, motion.torque - predicted - added, std


def size(values: np.ndarray) -> np.ndarray:
    """Root mean square of every joint."""
    return np.sqrt(np.mean(values**2, axis=0))


def parts(motion: Motion) -> tuple[Motion, Motion]:
    """What is learned from, and what comes after it."""
    return motion.part(0, TRAIN), motion.part(TRAIN, len(motion))


def noisy(motion: Motion, rng: np.random.Generator, memory: float = 0.0) -> Motion:
    """With errors of the torque that hang together over `memory`, s."""
    stays = np.exp(-1 / (RATE * memory)) if memory else 0.0
    white = rng.normal(size=(100 + len(motion), 2))
    coloured = lfilter([np.sqrt(1 - stays**2)], [1.0, -stays], white, axis=0)[100:]
    return replace(motion, torque=motion.torque + NOISE * coloured)


def test_without_noise_the_extra_torque_comes_back(arm: Observation) -> None:
    """Beside the true parameters, to the smallest noise that the process may assume (1e-6 of the variance)."""
    train, after = parts(with_extra(swings(arm, 0, SAMPLES)))
    found, _, estimate = learned(arm, train, true_values(arm))
    before, left, _ = errors(found, estimate, arm, after)
    assert found.learned == ("shoulder", "elbow")
    assert np.all(size(before) > 0.9) and np.all(size(left) < 1e-3 * size(before))


def test_fitted_parameters_leave_no_more_than_what_they_took(arm: Observation) -> None:
    """Least squares takes of the extra torque what it can, and is off by as much of the true torque: only that may be left."""
    train, after = parts(with_extra(swings(arm, 0, SAMPLES)))
    found, blocks, estimate = learned(arm, train)
    before, left, _ = errors(found, estimate, arm, after)
    true = driven(arm, after, true_values(arm)).torque
    taken = driven(arm, after, estimate.parameters.coordinates()).torque - true
    assert np.all(size(left) < size(taken))
    assert np.all(size(left) < 0.2 * size(before))
    assert np.all(blocks.together < 0.3 * blocks.physical)
    assert blocks.overall[1] < 0.3 * blocks.overall[0]


@dataclass(frozen=True)
class Learned:
    """From a noisy recording with the extra torques, of which `after` is what comes next."""

    found: LearnedResidual
    estimate: Estimate
    after: Motion

    @classmethod
    def of(cls, arm: Observation, seed: int, memory: float = 0.0) -> "Learned":
        train, after = parts(
            noisy(with_extra(swings(arm, seed, SAMPLES)), np.random.default_rng(seed), memory)
        )
        found, _, estimate = learned(arm, train)
        return cls(found, estimate, after)


@pytest.fixture(scope="module")
def some(arm: Observation) -> list[Learned]:
    return [Learned.of(arm, seed) for seed in (0, 1)]


def test_errors_are_those_of_the_torques(arm: Observation, some: list[Learned]) -> None:
    """`residual_errors` streams what `LearnedResidual.torque` gives."""
    found, estimate, after = some[0].found, some[0].estimate, some[0].after
    x = estimate.parameters.coordinates()
    streamed = residual_errors(found, recorded(arm, BaseParameters.of(arm), after), x)
    before, left, std = errors(found, estimate, arm, after)
    np.testing.assert_allclose(streamed.measured, np.linalg.norm(after.torque, axis=0))
    np.testing.assert_allclose(streamed.physical, np.linalg.norm(before, axis=0))
    np.testing.assert_allclose(streamed.together, np.linalg.norm(left, axis=0), rtol=1e-6)
    np.testing.assert_array_equal(streamed.inside, np.mean(np.abs(left) < 1.96 * std, axis=0))
    total = np.linalg.norm(after.torque)
    assert streamed.overall == pytest.approx([np.linalg.norm(before) / total, np.linalg.norm(left) / total])


def covered(arm: Observation, of: Learned) -> np.ndarray:
    """What is measured next beside what was predicted, in standard deviations (N, 2)."""
    _, left, std = errors(of.found, of.estimate, arm, of.after)
    return left / std


def test_intervals_hold_what_is_measured_next(arm: Observation, some: list[Learned]) -> None:
    scaled = np.concatenate([covered(arm, each) for each in some])
    assert 0.92 < np.mean(np.abs(scaled) < 1.96) < 0.995
    assert 0.7 < np.sqrt(np.mean(scaled**2)) < 1.2


def covered_in_recording(seed: int, arm: Observation, memory: float) -> np.ndarray:
    """The same of a recording with noise from a seed."""
    return covered(arm, Learned.of(arm, seed, memory))


@pytest.mark.slow
@pytest.mark.parametrize("memory", [0.0, 1.0])
def test_intervals_hold_what_is_measured_next_over_many_recordings(arm: Observation, memory: float) -> None:
    scaled = np.concatenate(over_seeds(covered_in_recording, range(20, 30), arm, memory))
    assert 0.93 < np.mean(np.abs(scaled) < 1.96) < 0.98
    assert 0.8 < np.sqrt(np.mean(scaled**2)) < 1.15


def test_where_there_is_nothing_to_learn_it_learns_nothing(arm: Observation) -> None:
    """Errors that hang together over a second look like a function of the position; nothing is added, and intervals are of the noise."""
    train, after = parts(noisy(swings(arm, 0, SAMPLES), np.random.default_rng(0), 1.0))
    found, blocks, estimate = learned(arm, train)
    before, left, std = errors(found, estimate, arm, after)
    assert found.learned == ()
    np.testing.assert_array_equal(left, before)
    assert blocks.overall[0] == blocks.overall[1]
    np.testing.assert_allclose(std, np.broadcast_to(blocks.physical**2 @ found.shares**2, std.shape) ** 0.5)


def of_noise(seed: int, arm: Observation) -> tuple[int, np.ndarray]:
    """Number of motors of which noise is learned, and the errors that are left beside those before (2,)."""
    train, after = parts(noisy(swings(arm, seed, SAMPLES), np.random.default_rng(seed), 1.0))
    found, _, estimate = learned(arm, train)
    before, left, _ = errors(found, estimate, arm, after)
    return len(found.learned), size(left) / size(before)


@pytest.mark.slow
def test_learning_noise_is_rare_and_harms_little(arm: Observation) -> None:
    """Ten recordings, two motors each."""
    taken, ratios = zip(*over_seeds(of_noise, range(10), arm), strict=True)
    assert sum(taken) <= 5
    assert np.mean(ratios) < 1.02 and np.max(ratios) < 1.15


def test_an_exact_model_leaves_nothing_to_learn(arm: Observation) -> None:
    """What is missed then is rounding."""
    found, blocks, _ = learned(arm, swings(arm, 0, 100))
    assert found.learned == () and blocks.overall[0] < 1e-9


def test_too_few_rows_are_refused(arm: Observation) -> None:
    with refused("E-DYN-029", "90", "100"):
        learned(arm, noisy(swings(arm, 0, 90), np.random.default_rng(0)))


def test_the_process_predicts_as_scikit_learn_does(rng: np.random.Generator) -> None:
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    inputs, fresh = np.array([1.0, 20.0, 0.1]) * rng.normal(size=(2, 150, 3))
    values = 7.0 * np.sin(inputs[:, 0] + 0.1 * inputs[:, 1]) + 0.5 * rng.normal(size=150)
    found = GaussianProcess.fitted(inputs, values)
    kernel = ConstantKernel(found.amplitude) * RBF(found.lengths) + WhiteKernel(found.noise)
    peer = GaussianProcessRegressor(kernel, optimizer=None, alpha=0.0).fit(inputs, values)
    mean, std = peer.predict(fresh, return_std=True)
    ours = found.predict(fresh)
    np.testing.assert_allclose(ours[0], mean, atol=1e-8 * np.abs(mean).max())
    np.testing.assert_allclose(ours[1], std, rtol=1e-6)
    assert found.noise == pytest.approx(0.25, rel=0.4)
    far = found.predict(1e3 * np.abs(inputs[:1]) + 1e3)
    assert far[0] == 0.0 and far[1] ** 2 == pytest.approx(found.amplitude + found.noise)
