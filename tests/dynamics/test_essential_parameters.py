"""Essential parameters: what matters stays, what does not goes, and the values are those of a fit without it."""

from dataclasses import replace

import numpy as np
import pytest

from flexcal.data.recordings import Decimation
from flexcal.dynamics.diagnostics import essential_parameters
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import RegressionData, assemble_regression
from flexcal.dynamics.signals import Motion
from flexcal.estimation import Estimate
from flexcal.model.robot import RobotModel

ABSENT = ("link_4.mc_x", "link_5.mc_x", "link_3.Ixy", "link_6.mc_x", "joint_2.torque_offset")


@pytest.fixture(scope="module")
def fitted(tx40: RobotModel, swing: Motion) -> tuple[RegressionData, Estimate]:
    """Torques of a robot that lacks five base parameters, with white noise of 1 % of each joint's torque."""
    observation = Observation(tx40, CLASSIC)
    base, rng = BaseParameters.of(observation), np.random.default_rng(4)
    beta = rng.uniform(1.0, 3.0, base.rank) * rng.choice([-1, 1], base.rank)
    beta[[base.identifiability.kept_names.index(name) for name in ABSENT]] = 0.0
    truth = np.zeros(len(observation.names))
    truth[list(base.identifiability.kept)] = beta
    columns = observation.columns(swing)
    torque = np.stack(
        [truth[m] @ c for m, c in zip(observation.column_indices, columns, strict=True)], axis=1
    )
    torque += 0.01 * np.linalg.norm(torque, axis=0) / np.sqrt(len(torque)) * rng.normal(size=torque.shape)
    data = assemble_regression(observation, base, [replace(swing, torque=torque)], Decimation(1))
    return data, weighted_least_squares(data)


def test_absent_parameters_go_first(fitted: tuple[RegressionData, Estimate]) -> None:
    data, estimate = fitted
    found = essential_parameters(data, estimate)
    assert set(found.eliminated[:5]) == set(ABSENT)
    assert set(found.names) | set(found.eliminated) == set(data.base.identifiability.kept_names)
    whole = data.errors(estimate.parameters.coordinates())[0]
    assert data.errors(found.parameters)[0] <= 1.05 * whole


def test_the_others_are_those_of_a_constrained_fit(fitted: tuple[RegressionData, Estimate]) -> None:
    """The values minimise (x - x̂)ᵀ V⁻¹ (x - x̂) with the eliminated at zero, and their covariance is V's given those."""
    data, estimate = fitted
    found, base = essential_parameters(data, estimate), data.base.identifiability
    kept = list(base.kept)
    full = base.regrouping @ estimate.parameters.coordinates()
    weight = np.linalg.inv(estimate.covariance[np.ix_(kept, kept)])
    stay = np.array([name in found.names for name in base.kept_names])
    inner = weight[np.ix_(stay, stay)]
    expected = np.linalg.solve(inner, weight[stay] @ full)
    np.testing.assert_allclose(found.values, expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(found.std, np.sqrt(np.diag(np.linalg.inv(inner))), rtol=1e-6)
    np.testing.assert_allclose((base.regrouping @ found.parameters)[stay], found.values, rtol=1e-9)
    np.testing.assert_allclose((base.regrouping @ found.parameters)[~stay], 0.0, atol=1e-12)
