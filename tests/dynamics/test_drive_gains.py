"""Drive gains from a payload of known mass: exact without noise, and free of the bias that noisy currents give least squares."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import refused
from two_links import GAINS, HELD, PAYLOAD, swings, two_links

from flexcal.data.recordings import Decimation
from flexcal.dynamics.drives import drive_gains
from flexcal.dynamics.estimators import instrumental_fit
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import Batch, RegressionData, assemble_regression


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Observation:
    return Observation(two_links(tmp_path_factory.mktemp("arm"), PAYLOAD), CLASSIC)


def recorded(arm: Observation, noise: float, seed: int) -> RegressionData:
    """The same swings without and with the payload."""
    rng = np.random.default_rng(seed)
    motions = [swings(arm, held, 7) for held in (0 * HELD, HELD)]
    noisy = [replace(m, torque=m.torque + noise * rng.normal(size=m.torque.shape)) for m in motions]
    return assemble_regression(arm, BaseParameters.of(arm), noisy, Decimation(1))


def test_without_noise_the_gains_come_back(arm: Observation) -> None:
    """Though centre of mass and inertia of the payload are not those of robot.yaml."""
    found = drive_gains(recorded(arm, 0.0, 0), [0.0, HELD[0]])
    assert found.parameters.names == ("shoulder.drive_gain", "elbow.drive_gain")
    assert found.parameters.coordinates() == pytest.approx(GAINS, rel=1e-9)
    assert found.identifiable == (True, True)


def scores(arm: Observation, runs: int) -> np.ndarray:
    """Errors over standard deviations (runs, 2), with torques whose noise is a tenth of their size."""
    return np.array(over_seeds(of_one_pair, range(runs), arm))


def of_one_pair(seed: int, arm: Observation) -> np.ndarray:
    found = drive_gains(recorded(arm, 3.0, seed), [0.0, HELD[0]])
    std = np.array([found.std(name) for name in found.parameters.names], dtype=float)
    return (found.parameters.coordinates() - GAINS) / std


def test_noise_in_the_torques_leaves_the_gains_unbiased(arm: Observation) -> None:
    found = scores(arm, 12)
    assert np.abs(found.mean(axis=0)).max() < 1.0
    assert 0.5 < np.sqrt(np.mean(found**2)) < 1.6


def test_least_squares_would_take_a_third(arm: Observation) -> None:
    """The same equations by dense least squares, written out: right without noise, far too small with it."""
    clean, noisy = (dense_least_squares(arm, noise) / GAINS for noise in (0.0, 3.0))
    assert clean == pytest.approx([1.0, 1.0], rel=1e-6)
    assert np.all(noisy < 0.8)


def dense_least_squares(arm: Observation, noise: float) -> np.ndarray:
    rng, parts, right = np.random.default_rng(0), [], []
    for held in (0 * HELD, HELD):
        motion = swings(arm, held, 7)
        torque = motion.torque + noise * rng.normal(size=motion.torque.shape)
        for joint, (members, columns) in enumerate(zip(arm.column_indices, arm.columns(motion), strict=True)):
            robot, gains = np.zeros((len(motion), len(arm.names))), np.zeros((len(motion), 2))
            robot[:, members], gains[:, joint] = columns.T, -torque[:, joint]
            loaded = robot[:, 10:20] if held.any() else np.zeros((len(motion), 10))
            parts.append(np.hstack([robot, loaded[:, 1:], gains]))
            right.append(-held[0] * loaded[:, 0])
    return np.linalg.lstsq(np.vstack(parts), np.concatenate(right), rcond=1e-10)[0][-2:]


@pytest.mark.slow
def test_intervals_of_gains_cover(arm: Observation) -> None:
    found = scores(arm, 300)
    print(f"mean {found.mean(axis=0)}, scatter {found.std(axis=0)}, held {np.mean(np.abs(found) < 1.98):.3f}")
    assert 0.92 < np.mean(np.abs(found) < 1.98) < 0.98
    assert np.abs(found.mean(axis=0)).max() < 0.3


def test_a_gain_that_drowns_is_not_identifiable(arm: Observation) -> None:
    found = drive_gains(recorded(arm, 300.0, 1), [0.0, HELD[0]])
    hidden = [entry.name for entry in found.dropped]
    assert hidden and not all(found.identifiable)
    assert found.std(hidden[0]) is None


def test_a_current_of_the_other_sign(arm: Observation) -> None:
    """Its gain is below zero, and known as well as any."""
    motions = [swings(arm, held, 7) for held in (0 * HELD, HELD)]
    turned = [replace(m, torque=m.torque * [1, -1]) for m in motions]
    found = drive_gains(
        assemble_regression(arm, BaseParameters.of(arm), turned, Decimation(1)), [0.0, HELD[0]]
    )
    assert found.parameters.coordinates() == pytest.approx(GAINS * [1, -1], rel=1e-9)
    assert found.identifiable == (True, True) and found.dropped == ()


def test_two_payloads_are_not_one(arm: Observation) -> None:
    """Their centres of mass and inertias are not the same, and one estimate of them would pass for both."""
    motions = [swings(arm, held, 7) for held in (0 * HELD, HELD, 0.5 * HELD)]
    data = assemble_regression(arm, BaseParameters.of(arm), motions, Decimation(1))
    with refused("E-DYN-002", "2", "4"):
        drive_gains(data, [0.0, 4.0, 2.0])


def test_a_payload_that_was_not_held(arm: Observation) -> None:
    """The same recording called loaded tells no gain."""
    noise = np.random.default_rng(0)
    free = [swings(arm, 0 * HELD, 7) for _ in range(2)]
    noisy = [replace(m, torque=m.torque + 0.3 * noise.normal(size=m.torque.shape)) for m in free]
    found = drive_gains(
        assemble_regression(arm, BaseParameters.of(arm), noisy, Decimation(1)), [0.0, HELD[0]]
    )
    assert found.identifiable == (False, False)


def test_instruments_that_follow_nothing(rng: np.random.Generator) -> None:
    """One of two has nothing of either column in it."""
    columns = rng.normal(size=(60, 2))
    basis = np.linalg.qr(np.column_stack([columns, rng.normal(size=60)]))[0]
    instruments = np.column_stack([columns[:, 0], basis[:, 2]])
    batch = Batch(0, 60, (np.column_stack([instruments, columns, columns.sum(axis=1)]),))
    with refused("E-DYN-006"):
        instrumental_fit([[batch]], [np.arange(2)], [1.0], np.zeros(2), [0, 1])


def test_pairs_that_are_none(arm: Observation, tmp_path: Path) -> None:
    data = recorded(arm, 1.0, 2)
    bare = Observation(two_links(tmp_path), CLASSIC)
    for payloads, observation in (([0.0, 0.0], arm), ([HELD[0], HELD[0]], arm), ([0.0, HELD[0]], bare)):
        with refused("E-DYN-001"):
            drive_gains(replace(data, observation=observation), payloads)
