"""Power and energy of all joints as one equation: the truth without noise, no accelerations, true intervals though windows overlap."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from recovery import NOISE, covered, driven, errors, recorded
from refusals import refused

from flexcal.dynamics.estimators import RecordedRows, energy_least_squares, power_least_squares
from flexcal.dynamics.estimators.energy_model import EnergyModel
from flexcal.dynamics.estimators.power_model import PowerModel
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.regression import RegressionData
from flexcal.dynamics.signals import Motion
from flexcal.estimation import Estimate


@pytest.fixture(scope="module")
def clean(
    observation: Observation, truth: np.ndarray, sines: Callable[[int, float], Motion]
) -> Callable[[int, float], Motion]:
    """clean(samples, rate_hz): with the torques of the truth."""
    return lambda samples, rate_hz: driven(observation, sines(samples, rate_hz), truth)


def test_the_power_model_finds_the_truth(
    observation: Observation, base: BaseParameters, clean: Callable[[int, float], Motion], truth: np.ndarray
) -> None:
    found = power_least_squares(recorded(observation, base, clean(2000, 200.0)))
    assert found.rank == 61
    assert max(map(abs, errors(found, observation, truth).values())) < 1e-7


def test_the_energy_model_finds_the_truth_up_to_the_integral(
    observation: Observation, base: BaseParameters, clean: Callable[[int, float], Motion], truth: np.ndarray
) -> None:
    """The trapezoidal rule's error falls with the square of the step."""
    rates = (200.0, 800.0)
    found = [energy_least_squares(recorded(observation, base, clean(int(10 * rate), rate))) for rate in rates]
    assert found[0].rank == found[1].rank == 61
    coarse, fine = (max(map(abs, errors(f, observation, truth).values())) for f in found)
    assert 10 < coarse / fine < 30


def test_the_energy_model_has_no_accelerations_and_blocks_add_up(
    observation: Observation,
    clean: Callable[[int, float], Motion],
    truth: np.ndarray,
    rng: np.random.Generator,
) -> None:
    """Cut anywhere, with accelerations that are nonsense, the rows are those of the whole."""
    motion = clean(500, 200.0)
    model = EnergyModel(observation)
    whole = model.reduced(motion)
    garbled = replace(motion, ddq=rng.normal(size=motion.ddq.shape))
    memory = {}
    parts = [model.reduced(garbled.part(a, b), memory) for a, b in ((0, 3), (3, 4), (4, 260), (260, 500))]
    np.testing.assert_allclose(np.hstack(parts), whole, rtol=1e-9, atol=1e-9)


def test_a_row_of_energy_is_the_work_of_its_window(
    observation: Observation, clean: Callable[[int, float], Motion]
) -> None:
    """Against the integral of the power model's rows, accelerations and all, over 100 steps; the first windows are shorter."""
    motion = clean(4000, 1000.0)
    power = PowerModel(observation).reduced(motion)
    energy = EnergyModel(observation).reduced(motion)
    work = np.cumsum(0.5 * (power[:, 1:] + power[:, :-1]), axis=1) / 1000.0
    work = np.hstack([np.zeros((len(work), 1)), work])
    size = np.abs(energy).max(axis=1, keepdims=True) + 1e-9
    assert np.all(np.abs(energy[:, :100] - work[:, :100]) < 2e-3 * size)
    assert np.all(np.abs(energy[:, 100:] - (work[:, 100:] - work[:, :-100])) < 2e-3 * size)


def test_motion_that_is_too_short_is_refused(
    observation: Observation, base: BaseParameters, clean: Callable[[int, float], Motion]
) -> None:
    with refused("E-DYN-012", "the power of all joints"):
        power_least_squares(recorded(observation, base, clean(40, 5.0)))


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("estimator", "model"), [(power_least_squares, PowerModel), (energy_least_squares, EnergyModel)]
)
def test_intervals_cover(
    estimator: Callable[[RecordedRows], Estimate],
    model: Callable[[Observation], EnergyModel | PowerModel],
    observation: Observation,
    base: BaseParameters,
    clean: Callable[[int, float], Motion],
    truth: np.ndarray,
    rng: np.random.Generator,
) -> None:
    """Ten recordings of 61 parameters; windows that overlap by nine rows make (WᵀW)⁻¹σ² too small."""
    motion = clean(3000, 100.0)
    inside, white = [], []
    for _ in range(10):
        noisy = replace(motion, torque=motion.torque + NOISE * rng.normal(size=motion.torque.shape))
        rows = recorded(observation, base, noisy)
        found = estimator(rows)
        nominal = white_std(rows.observed_as(model(observation)))
        missed = errors(found, observation, truth)
        inside.append(covered(found, missed))
        white += [
            abs(error) <= 1.96 * nominal[observation.names.index(name)] for name, error in missed.items()
        ]
    assert 0.92 < np.mean(inside) < 0.975
    if model is EnergyModel:
        assert np.mean(white) < 0.75


def white_std(data: RegressionData) -> np.ndarray:
    """Standard deviations (p,) for errors that are independent from row to row, zero for those that are no base parameters."""
    ((sigma, _),) = data.noise()
    kept = list(data.base.identifiability.kept)
    matrix = data.subsystems[0].triangle.matrix[:, kept] / sigma
    scale = np.linalg.norm(matrix, axis=0)
    std = np.zeros(len(data.names))
    std[kept] = np.sqrt(np.diag(np.linalg.inv((matrix / scale).T @ (matrix / scale)))) / scale
    return std
