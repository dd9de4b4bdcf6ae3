"""How surely gravity presses a joint onto one flank of its backlash, against drawn inertials."""

from dataclasses import replace

import numpy as np
import pytest

from flexcal.estimation import Parameter, Parameters
from flexcal.model.robot import Posterior, RobotModel
from flexcal.model.statics import certain_flank, gravity_torque
from flexcal.model.statics.equilibrium import gravity_regressor
from flexcal.model.statics.flank import gravity_torque_std


def test_std_against_inertials_drawn_from_the_prior(tx90l: RobotModel, rng: np.random.Generator) -> None:
    q = rng.uniform(-2, 2, (4, 6))
    draws = []
    for _ in range(600):
        values = {"payload.mass": tx90l.payload.mass + rng.normal(0, tx90l.payload.mass_std)}
        for joint in tx90l.joints:
            values[f"{joint.link}.mass"] = tx90l.value(f"{joint.link}.mass") * (1 + 0.07 * rng.normal())
            for axis in "xyz":
                values[f"{joint.link}.com_{axis}"] = (
                    tx90l.value(f"{joint.link}.com_{axis}") + 0.01 * rng.normal()
                )
        changed = tx90l.with_values(values)
        draws.append(gravity_torque(changed, q))
    np.testing.assert_allclose(gravity_torque_std(tx90l, q), np.std(draws, axis=0), rtol=0.12, atol=1e-3)


@pytest.mark.statistical
def test_std_against_inertials_drawn_from_the_posterior(tx90l: RobotModel, rng: np.random.Generator) -> None:
    """Masses as logarithms, correlated with a centre of mass; what was not estimated keeps its prior."""
    q = rng.uniform(-2, 2, (4, 6))
    names = ("link_2.mass", "link_3.com_x", "payload.mass")
    scales = ("log", "linear", "log")
    parameters = Parameters(
        Parameter(n, "", tx90l.value(n), scale=s) for n, s in zip(names, scales, strict=True)
    )
    covariance = np.array([[4e-4, 3e-5, 0], [3e-5, 4e-6, 0], [0, 0, 1e-4]])
    known = replace(tx90l, posterior=Posterior(parameters, covariance))
    draws = []
    for deviation in rng.multivariate_normal(np.zeros(3), covariance, 3000):
        coordinates = parameters.coordinates() + deviation
        draws.append(dict(zip(names, parameters.natural(coordinates), strict=True)))
    torques = [gravity_torque(tx90l.with_values(values), q) for values in draws]
    certain = replace(tx90l, config=replace(tx90l.config, prior=replace(tx90l.prior, mass=0.0, com=0.0)))
    alone = replace(certain, posterior=known.posterior)
    np.testing.assert_allclose(gravity_torque_std(alone, q), np.std(torques, axis=0), rtol=0.08, atol=1e-3)
    assert (gravity_torque_std(known, q)[:, 1] < gravity_torque_std(tx90l, q)[:, 1]).all()


@pytest.mark.parametrize("payload", [0.0, 3.0, 6.0, np.array([0.0, 2.0, 6.0])])
def test_regressor_against_differences(
    tx90l: RobotModel, rng: np.random.Generator, payload: float | np.ndarray
) -> None:
    q = rng.uniform(-2, 2, (3, 6))
    regressor = gravity_regressor(tx90l, q, payload).reshape(3, 6, 6, 4)
    for k, joint in enumerate(tx90l.joints):
        step, name = 1e-4, f"{joint.link}.mass"
        high, low = (
            gravity_torque(tx90l.with_values({name: tx90l.value(name) + sign * step}), q, payload)
            for sign in (1, -1)
        )
        slope = regressor[:, :, k, 0] + regressor[:, :, k, 1:] @ tx90l.links.com[k]
        np.testing.assert_allclose(slope, (high - low) / (2 * step), atol=1e-5)


def test_certain_means_three_standard_deviations(tx90l: RobotModel, rng: np.random.Generator) -> None:
    q = rng.uniform(-2, 2, (500, 6))
    torque, std = gravity_torque(tx90l, q), gravity_torque_std(tx90l, q)
    certain = certain_flank(tx90l, q, torque)
    np.testing.assert_array_equal(certain, np.abs(torque) > 3 * std)
    assert certain[:, 1].any() and not certain[:, 1].all()
    assert (gravity_torque_std(tx90l, q, 0.0) <= std).all() and (
        gravity_torque_std(tx90l, q, 0.0) < std
    ).any()
