"""Mixed total least squares: the truth without noise and with noisy columns, exact columns that stay exact, and noise read from a log."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recovery import NOISE, covered, driven, errors, recorded
from refusals import refused

from flexcal.data.recordings import Decimation, Recording, write_recording
from flexcal.dynamics.estimators import (
    Unknowns,
    noise_levels,
    perturbed_logs,
    regressor_errors,
    total_least_squares,
    weighted_least_squares,
    weighted_system,
)
from flexcal.dynamics.estimators.column_noise import position_noise
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.regression import RegressionData, assemble_regression
from flexcal.dynamics.signals import JointLog, Motion
from flexcal.estimation import Estimate

SPEED, ACCELERATION = 0.05, 1.5


@pytest.fixture(scope="module")
def clean(observation: Observation, truth: np.ndarray, swing: Motion) -> Motion:
    return driven(observation, swing, truth)


def spoilt(motion: Motion, rng: np.random.Generator) -> Motion:
    """Velocities and accelerations with noise."""
    dq = motion.dq + SPEED * rng.normal(size=motion.dq.shape)
    return replace(motion, dq=dq, ddq=motion.ddq + ACCELERATION * rng.normal(size=motion.ddq.shape))


def fitted(
    observation: Observation, base: BaseParameters, motion: Motion, noisy: Motion
) -> tuple[Estimate, Estimate]:
    """Total and plain."""
    data = assemble_regression(observation, base, [motion], Decimation(1))
    return total_least_squares(
        data, regressor_errors(recorded(observation, base, motion), [noisy])
    ), weighted_least_squares(data)


def test_without_noise_the_truth_comes_back(
    observation: Observation, base: BaseParameters, clean: Motion, truth: np.ndarray, rng: np.random.Generator
) -> None:
    """Whatever is thought of the errors of the columns; and without such errors it is weighted least squares."""
    found, plain = fitted(observation, base, clean, spoilt(clean, rng))
    assert found.rank == 61
    assert max(map(abs, errors(found, observation, truth).values())) < 1e-7
    noisy = replace(clean, torque=clean.torque + NOISE * rng.normal(size=clean.torque.shape))
    found, plain = fitted(observation, base, noisy, noisy)
    np.testing.assert_allclose(
        found.parameters.coordinates(), plain.parameters.coordinates(), rtol=1e-8, atol=1e-8
    )
    np.testing.assert_allclose(found.covariance, plain.covariance, rtol=1e-6, atol=1e-12)


@pytest.mark.statistical
def test_noisy_columns_bend_least_squares_and_not_this(
    observation: Observation, base: BaseParameters, clean: Motion, truth: np.ndarray, rng: np.random.Generator
) -> None:
    """Eight recordings: mean errors in standard deviations of a mean of eight, and intervals; unwhitened it is far worse.

    What the bent parameters leave of the torques follows the motion: noise with a long memory, which widens the intervals of the others.
    """
    total, plain, inside, plain_inside, blind = [], [], [], [], []
    for _ in range(8):
        noisy = spoilt(clean, rng)
        noisy = replace(noisy, torque=noisy.torque + NOISE * rng.normal(size=noisy.torque.shape))
        both = fitted(observation, base, noisy, spoilt(noisy, rng))
        for estimate, kept, counted in zip(both, (total, plain), (inside, plain_inside), strict=True):
            missed = errors(estimate, observation, truth)
            kept.append(np.array(list(missed.values())))
            counted.append(covered(estimate, missed))
        blind.append(
            errors(
                unwhitened(assemble_regression(observation, base, [noisy], Decimation(1))), observation, truth
            )
        )
    assert np.median(bias(total)) < 1.2 and np.median(bias(plain)) > 2.0
    assert 0.92 < np.mean(inside) < 0.98
    assert np.mean(plain_inside) > 0.92
    sizes = [np.sqrt(np.mean(np.square(kept), axis=0)) for kept in (total, [list(b.values()) for b in blind])]
    assert np.median(sizes[1] / sizes[0]) > 3.0


def bias(kept: list[np.ndarray]) -> np.ndarray:
    """Mean errors over their standard deviations."""
    return np.abs(np.mean(kept, axis=0)) / (np.std(kept, axis=0, ddof=1) / np.sqrt(len(kept)))


def unwhitened(data: RegressionData) -> Estimate:
    """The textbook's: the last right singular vector of [W, Y], every column alike in its own unit."""
    system = weighted_system(data, noise_levels(data))
    unknowns = Unknowns.of(data, system)
    factor, scale = unknowns.reduced(system)
    factor[:, :-1] /= scale
    last = np.linalg.svd(factor)[2][-1]
    found = data.observation.values()
    found[unknowns.kept] -= last[:-1] / last[-1]
    return unknowns.estimate(found, np.eye(len(unknowns.kept)), 1.0, 0.0, 1, "")


def test_signs_and_constants_are_exact(
    observation: Observation, base: BaseParameters, clean: Motion, rng: np.random.Generator
) -> None:
    wrong = regressor_errors(recorded(observation, base, clean), [spoilt(clean, rng)])
    for s in wrong.subsystems:
        size = np.linalg.norm(s.triangle.matrix, axis=0)
        names = [observation.names[m] for m in s.column_indices]
        exact = [name.rpartition(".")[2].startswith(("coulomb", "torque_offset")) for name in names]
        assert any(exact) and np.all(size[exact] == 0.0)
        noisy = [name.rpartition(".")[2].startswith(("viscous", "rotor_inertia")) for name in names]
        assert np.all(size[noisy] > 0.0)
        assert np.all(s.triangle.right == 0.0) and s.triangle.rows == len(clean)


def test_the_noise_of_a_log_is_read_from_it(
    tmp_path: Path, swing: Motion, observation: Observation, base: BaseParameters, rng: np.random.Generator
) -> None:
    std = np.array([1e-4, 2e-4, 5e-5, 1e-4, 1e-3, 1e-4])
    path = tmp_path / "log.parquet"
    torque = 20.0 * np.cos(swing.q)
    write_recording(path, Recording(1 / 200, swing.q + std * rng.normal(size=swing.q.shape), torque))
    log = JointLog.read(path, observation.model, 10.0, tmp_path)
    np.testing.assert_allclose(position_noise(log, observation.model), std, rtol=0.1)
    (noisy,) = perturbed_logs(recorded(observation, base, log))
    added = Motion.joined(noisy.blocks()).q - Motion.joined(log.blocks()).q
    again = Motion.joined(noisy.blocks()).q - Motion.joined(log.blocks()).q
    np.testing.assert_array_equal(added, again)
    passed = np.std(added, axis=0) / std  # a low-pass at 10 of 100 Hz leaves about a tenth of the power
    assert np.all((passed > 0.2) & (passed < 0.4))
    with refused("E-DYN-004"):
        perturbed_logs(recorded(observation, base, swing))
