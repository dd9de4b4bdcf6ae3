"""Intervals of identified dynamics, from CSV logs of a simulator of its own to estimates, with the defaults: they hold the truth."""

from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from planar_arm import TRUTH, Log, torque
from scipy.stats import t as student

from flexcal.dynamics.estimators import EstimatorName
from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.signals import Motion
from flexcal.estimation import Estimate
from flexcal.jobs.dynamics import DynamicsIdentification, identify_robot_dynamics

NOISY_POSITIONS = Log(position_noise=3e-5)
"""The torques are exact: only positions are noisy, and with them velocities and accelerations."""
LONG_MEMORY = Log(torque_noise=0.5, memory=1.5)
PERIODS = {"duration": 25.0, "fundamental": 0.2}


def inside(found: DynamicsIdentification) -> tuple[np.ndarray, np.ndarray]:
    """Which 95 % intervals hold the truth: those of base parameters, and those of the torques of forty states."""
    estimate = found.estimate
    hidden = {entry.name for entry in estimate.dropped}
    expected = estimate.regrouped({name: TRUTH.get(name, 0.0) for name in estimate.parameters.names})
    ends = [(expected[n], estimate.interval(n) or (np.nan, np.nan)) for n in expected if n not in hidden]
    held = [low < value < high for value, (low, high) in ends]
    return np.array(held), _torques_inside(found, estimate)


def _torques_inside(found: DynamicsIdentification, estimate: Estimate) -> np.ndarray:
    rng = np.random.default_rng(99)
    q, dq, ddq = (size * rng.uniform(-1, 1, (40, 2)) for size in (2.0, 2.0, 4.0))
    observation = found.train.observation
    assert isinstance(observation, Observation)
    columns = observation.columns(Motion(np.arange(40.0), q, dq, ddq, np.zeros_like(q)))
    true, x = torque(q, dq, ddq), estimate.parameters.coordinates()
    quantile = student.ppf(0.975, estimate.covariance_freedom)
    held = []
    for joint, (members, own) in enumerate(zip(observation.column_indices, columns, strict=True)):
        covariance = estimate.covariance[np.ix_(members, members)]
        std = np.sqrt(np.einsum("it,ij,jt->t", own, covariance, own))
        held.append(np.abs(x[members] @ own - true[:, joint]) < quantile * std)
    return np.concatenate(held)


def held(seed: int, folder: Path, log: Log, estimator: EstimatorName) -> list[float]:
    """Share of base parameters and of torques within the intervals of one log."""
    (folder := folder / str(seed)).mkdir()
    robot, path = log.write(folder, seed)
    return [own.mean() for own in inside(identify_robot_dynamics(robot, [path], estimator=estimator))]


def coverage(folder: Path, log: Log, estimator: EstimatorName, seeds: range) -> tuple[float, float]:
    """Of base parameters and of torques."""
    parameters, torques = np.mean(over_seeds(held, seeds, folder, log, estimator), axis=0)
    print(f"{estimator} {log}: {parameters:.3f} of the parameters, {torques:.3f} of the torques")
    return float(parameters), float(torques)


def test_an_exact_log_gives_the_truth(tmp_path: Path) -> None:
    """Whatever filter, differences and reversals leave of an error is no noise, and no interval allows for it."""
    robot, path = Log().write(tmp_path, 3)
    estimate = identify_robot_dynamics(robot, [path]).estimate
    expected = estimate.regrouped({name: TRUTH.get(name, 0.0) for name in estimate.parameters.names})
    missed = [
        abs(estimate.values[n] - v)
        for n, v in expected.items()
        if n not in {d.name for d in estimate.dropped}
    ]
    assert max(missed) < 1e-7


def test_noise_that_remembers_itself_for_a_second_and_a_half(tmp_path: Path) -> None:
    parameters, torques = coverage(tmp_path, LONG_MEMORY, "wls", range(3))
    assert parameters > 0.9 and torques > 0.9


def test_positions_alone_are_noisy(tmp_path: Path) -> None:
    """A Kalman filter that took the noise of accelerations into W had .64, with errors of inertias up to ten times as large."""
    log = Log(duration=10.0, rate=250.0, position_noise=3e-4)
    parameters, torques = coverage(tmp_path, log, "ekf", range(1))
    assert parameters > 0.88 and torques > 0.88


@pytest.mark.slow
@pytest.mark.parametrize("memory", [0.05, 0.2, 0.5, 1.5])
@pytest.mark.parametrize("duration", [10.0, 20.0, 30.0])
def test_torques_in_noise_with_memory(memory: float, duration: float, tmp_path: Path) -> None:
    """Those of parameters may be wider than they had to be where a log of few time constants does not tell its own noise."""
    log = Log(duration=duration, torque_noise=0.5, memory=memory)
    parameters, torques = coverage(tmp_path, log, "wls", range(60))
    assert parameters >= 0.92
    assert 0.92 <= torques <= 0.99
    if memory < duration / 20:
        assert parameters <= 0.99


@pytest.mark.slow
@pytest.mark.parametrize(
    "log",
    [NOISY_POSITIONS, Log(position_noise=3e-5, torque_noise=0.5, memory=0.1)],
    ids=["positions alone", "positions and torques"],
)
def test_kalman_filter(log: Log, tmp_path: Path) -> None:
    parameters, torques = coverage(tmp_path, log, "ekf", range(25))
    assert 0.9 <= parameters <= 0.98
    assert 0.9 <= torques <= 0.98


@pytest.mark.slow
@pytest.mark.parametrize(
    "log", [Log(position_noise=3e-4), LONG_MEMORY], ids=["noisier positions alone", "long memory"]
)
def test_kalman_filter_where_it_is_cautious(log: Log, tmp_path: Path) -> None:
    """Intervals here are up to 1.3 times as wide as they had to be: 99 % of them hold the truth."""
    parameters, torques = coverage(tmp_path, log, "ekf", range(25))
    assert parameters >= 0.9 and torques >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize(
    "noise", [{"position_noise": 3e-5}, {"torque_noise": 0.5, "memory": 1.5}], ids=["positions", "torques"]
)
def test_maximum_likelihood(noise: dict[str, float], tmp_path: Path) -> None:
    parameters, torques = coverage(tmp_path, Log(**PERIODS, **noise), "ml", range(40))
    assert 0.9 <= parameters <= 0.98
    assert 0.9 <= torques <= 0.98
