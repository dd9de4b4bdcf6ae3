"""The extended Kalman filter: near the truth without noise, true intervals and innovations with it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from over_seeds import over_seeds
from recovery import NOISE, covered, driven, errors, recorded
from refusals import refused

from flexcal.data.recordings import Decimation
from flexcal.dynamics.estimators import kalman_filter, weighted_least_squares
from flexcal.dynamics.estimators.ekf import POSITION_NOISE
from flexcal.dynamics.friction import Presliding, WarmUp
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.regression import assemble_regression
from flexcal.dynamics.signals import Motion, Window
from flexcal.dynamics.simulation import discretise_motion
from flexcal.estimation import Estimate
from flexcal.model.robot import RobotModel


@pytest.fixture(scope="module")
def truth(observation: Observation) -> np.ndarray:
    """A robot with a mass matrix: CAD, off by a tenth, rotor inertias and friction that CAD does not know."""
    rng = np.random.default_rng(3)
    values = observation.values() * rng.normal(1.0, 0.1, len(observation.names))
    for number, name in enumerate(observation.names):
        if name.endswith("rotor_inertia"):
            values[number] = 0.3
        elif name.startswith("joint"):
            values[number] = rng.uniform(0.1, 0.3)
    return values


@pytest.fixture(scope="module")
def clean(
    observation: Observation, truth: np.ndarray, sines: Callable[[int, float], Motion]
) -> Callable[[int, float], Motion]:
    """clean(samples, rate_hz): with the torques of the truth."""
    return lambda samples, rate_hz: driven(observation, sines(samples, rate_hz), truth)


def filtered(observation: Observation, base: BaseParameters, motion: Motion) -> tuple[Estimate, Estimate]:
    """And weighted least squares."""
    data = assemble_regression(observation, base, [motion], Decimation(1))
    return kalman_filter(data, recorded(observation, base, motion)), weighted_least_squares(data)


def test_without_noise_it_comes_near_the_truth(
    observation: Observation, base: BaseParameters, clean: Callable[[int, float], Motion], truth: np.ndarray
) -> None:
    """As near as steps of 5 ms and the prior let it; CAD is fifty times as far."""
    found, _ = filtered(observation, base, clean(800, 200.0))
    assert found.rank == 61
    missed = errors(found, observation, truth)
    begun = [observation.values()[observation.names.index(name)] - found.values[name] for name in missed]
    left = np.sqrt(np.mean(np.square(list(missed.values()))))
    assert left < 3e-3
    assert np.sqrt(np.mean(np.square(begun))) > 50 * left


def test_intervals_cover_and_innovations_are_white(
    observation: Observation,
    base: BaseParameters,
    clean: Callable[[int, float], Motion],
    truth: np.ndarray,
) -> None:
    inside, ratio, innovations = scatter(observation, base, clean(1000, 200.0), truth, 2)
    assert 0.88 < inside < 0.99
    assert ratio < 1.1
    assert all(0.8 < square < 1.2 for square in innovations)


@pytest.mark.slow
def test_intervals_cover_in_many_recordings(
    observation: Observation,
    base: BaseParameters,
    clean: Callable[[int, float], Motion],
    truth: np.ndarray,
) -> None:
    inside, _, _ = scatter(observation, base, clean(4000, 400.0), truth, 20)
    print(f"{100 * inside:.1f} % of intervals")
    assert 0.92 < inside < 0.97


def scatter(
    observation: Observation,
    base: BaseParameters,
    motion: Motion,
    truth: np.ndarray,
    recordings: int,
) -> tuple[float, float, list[float]]:
    """Share of intervals that hold the truth, median error over that of weighted least squares, mean innovations squared."""
    found = over_seeds(of_one_recording, range(recordings), observation, base, motion, truth)
    inside, ratios, innovations = zip(*found, strict=True)
    return float(np.mean(inside)), float(np.median(ratios)), list(innovations)


def of_one_recording(
    seed: int, observation: Observation, base: BaseParameters, motion: Motion, truth: np.ndarray
) -> tuple[np.ndarray, list[float], float]:
    rng = np.random.default_rng([20150917, seed])
    noisy = replace(
        motion,
        torque=motion.torque + NOISE * rng.normal(size=motion.torque.shape),
        q=motion.q + POSITION_NOISE * rng.normal(size=motion.q.shape),
    )
    found, other = filtered(observation, base, noisy)
    missed, plain = errors(found, observation, truth), errors(other, observation, truth)
    ratios = [abs(missed[name] / plain[name]) for name in missed]
    return covered(found, missed), ratios, float(found.message.split("squared ")[1].split(",")[0])


def test_a_standstill_ends_the_motion_and_not_the_parameters(
    observation: Observation, base: BaseParameters, clean: Callable[[int, float], Motion], truth: np.ndarray
) -> None:
    """Half a second at rest, with torques that no friction tells, changes nothing but by the steps at its ends."""
    motion = clean(600, 100.0)
    at = np.r_[np.arange(300), np.full(50, 299), np.arange(300, 600)]
    rest = (at == 299) & (np.arange(650) >= 300)
    held = Motion(
        np.arange(650) / 100.0,
        motion.q[at],
        motion.dq[at] * ~rest[:, None],
        motion.ddq[at] * ~rest[:, None],
        np.where(rest[:, None], 50.0, motion.torque[at]),
    )
    whole, _ = filtered(observation, base, motion)
    paused, _ = filtered(observation, base, held)
    differ = [abs(paused.values[name] - whole.values[name]) for name in base.identifiability.kept_names]
    assert max(differ) < 0.02


def test_a_robot_without_mass_is_refused(
    observation: Observation, base: BaseParameters, swing: Motion, rng: np.random.Generator
) -> None:
    """Torques that have nothing to do with the motion leave the second pass a mass matrix that no robot has."""
    pushed = replace(swing, torque=-5.0 * swing.ddq + 0.1 * rng.normal(size=swing.torque.shape))
    with refused("E-DYN-044"):
        filtered(observation, base, pushed)


def test_a_window_begins_with_what_friction_remembers(tx40: RobotModel, swing: Motion) -> None:
    """Columns of steps inside a window are those that all steps have there."""
    observation = Observation(tx40, (WarmUp(20.0), Presliding((0.02,) * 6)))
    slowest = np.zeros(6)
    whole = list(discretise_motion(observation, swing, Window(), slowest))
    late = list(discretise_motion(observation, swing, Window(start=5.0, end=8.0), slowest))
    time, again = (np.concatenate([steps.middle.time for steps in parts]) for parts in (whole, late))
    columns, found = (np.concatenate([steps.columns for steps in parts]) for parts in (whole, late))
    inside = (time > 5.0) & (time < 7.995)
    np.testing.assert_allclose(again, time[inside])
    np.testing.assert_allclose(found, columns[inside], rtol=0, atol=0.02)
