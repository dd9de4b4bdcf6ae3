"""The energy regressor against Pinocchio's energies, and against the power of the torques."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal.model.robot import RobotModel
from flexcal.model.torques import energy_regressor, inertial_parameters, torque_regressor


@pytest.fixture(params=["tx90l", "ur5"])
def robot(request: pytest.FixtureRequest) -> RobotModel:
    return request.getfixturevalue(request.param)


def test_the_energy_is_pinocchios(robot: RobotModel, rng: np.random.Generator) -> None:
    model = pin.buildModelFromUrdf(str(robot.urdf))
    model.gravity = pin.Motion(robot.gravity, np.zeros(3))
    data = model.createData()
    q, dq = rng.normal(size=(2, 7, robot.n))
    found = energy_regressor(robot, q, dq) @ inertial_parameters(robot)
    expected = np.array(
        [
            pin.computeKineticEnergy(model, data, *state) + pin.computePotentialEnergy(model, data, state[0])
            for state in zip(q, dq, strict=True)
        ]
    )
    # links fixed to the base have energy for Pinocchio, always the same
    np.testing.assert_allclose(found - found[0], expected - expected[0], rtol=1e-12, atol=1e-11)


def test_it_changes_by_the_power_of_the_torques(robot: RobotModel, rng: np.random.Generator) -> None:
    """Every column, by central differences along a motion, geometric errors included."""
    bent = replace(
        robot,
        geometry=replace(
            robot.geometry, errors=robot.geometry.errors + 0.01 * rng.normal(size=robot.geometry.errors.shape)
        ),
    )
    q, dq, ddq = rng.normal(size=(3, 5, robot.n))
    h = 1e-5
    ahead = energy_regressor(bent, q + h * dq + h**2 / 2 * ddq, dq + h * ddq)
    behind = energy_regressor(bent, q - h * dq + h**2 / 2 * ddq, dq - h * ddq)
    power = np.einsum("sj,sjk->sk", dq, torque_regressor(bent, q, dq, ddq))
    np.testing.assert_allclose((ahead - behind) / (2 * h), power, atol=1e-7)


def test_shapes_that_differ_are_refused(robot: RobotModel) -> None:
    with refused("E-MODEL-009"):
        energy_regressor(robot, np.zeros((2, 6)), np.zeros((3, 6)))
