"""The regressor's adjoint against Pinocchio's derivatives of the inverse dynamics, and against differences that have no remainder."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal.model.robot import RobotModel
from flexcal.model.torques import (
    placed_regressor_adjoint,
    torque_regressor,
    torque_regressor_adjoint,
    write_torque_regressor,
)

TO_PINOCCHIO = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]  # its Iyy comes before Ixz


@pytest.fixture(params=["tx90l", "ur5", "tree"])
def robot(request: pytest.FixtureRequest) -> RobotModel:
    return request.getfixturevalue(request.param)


def bent(robot: RobotModel, rng: np.random.Generator) -> RobotModel:
    """With large geometric errors, and every joint about the axis of a bearing that leans."""
    geometry = robot.geometry.errors + 0.1 * rng.normal(size=robot.geometry.errors.shape)
    frames = {i: pin.exp3(rng.normal(size=3)) for i in range(robot.n)}
    return replace(
        robot,
        geometry=replace(robot.geometry, errors=geometry),
        springs=replace(robot.springs, bearing_frames=frames),
    )


def test_with_inertials_for_weights_it_is_pinocchios(robot: RobotModel, rng: np.random.Generator) -> None:
    """f = λᵀ W χ has λᵀ ∂τ/∂q, λᵀ ∂τ/∂q̇ and λᵀ M, for any λ and χ, others at every sample."""
    motion = rng.normal(size=(3, 7, robot.n))
    torque, inertials = rng.normal(size=(7, robot.n)), rng.normal(size=(7, robot.n, 10))
    inertials[:, :, 0] = rng.uniform(1, 2, (7, robot.n))
    weights = torque[:, :, None] * inertials.reshape(7, 1, -1)
    found = torque_regressor_adjoint(robot, *motion, weights)

    model = pin.buildModelFromUrdf(str(robot.urdf))
    model.gravity = pin.Motion(robot.gravity, np.zeros(3))
    expected = np.empty_like(found)
    for k in range(7):
        for link in range(robot.n):
            model.inertias[link + 1] = pin.Inertia.FromDynamicParameters(inertials[k, link, TO_PINOCCHIO])
        data = model.createData()
        pin.computeRNEADerivatives(model, data, *motion[:, k])
        mass = np.triu(data.M) + np.triu(data.M, 1).T
        expected[:, k] = torque[k] @ [data.dtau_dq, data.dtau_dv, mass]
    for ours, theirs in zip(found, expected, strict=True):
        assert np.abs(ours - theirs).max() < 1e-12 * np.abs(theirs).max()


def test_it_is_the_derivative_of_the_regressor(robot: RobotModel, rng: np.random.Generator) -> None:
    """By differences that are exact: W is a trigonometric polynomial of an angle, a quadratic one of a slide and of q̇, and linear in
    q̈.
    """
    robot = bent(robot, rng)
    motion = rng.normal(size=(3, 5, robot.n))
    weights = rng.normal(size=(5, robot.n, 10 * robot.n))
    found = torque_regressor_adjoint(robot, *motion, weights)

    k = np.arange(1, 9)
    turns = 2 * np.pi * k / 9, -0.5 * (-1.0) ** k / np.sin(np.pi * k / 9)
    steps = np.array([1.0, -1.0]), np.array([0.5, -0.5])
    for part, joint in np.ndindex(3, robot.n):
        angle = part == 0 and robot.joints[joint].kind != "prismatic"
        expected = np.zeros(5)
        for shift, factor in zip(*(turns if angle else steps), strict=True):
            moved = motion.copy()
            moved[part, :, joint] += shift
            expected += factor * np.sum(weights * torque_regressor(robot, *moved), axis=(1, 2))
        np.testing.assert_allclose(found[part, :, joint], expected, rtol=0, atol=1e-12 * np.abs(found).max())


def test_samples_do_not_know_each_other(tree: RobotModel, rng: np.random.Generator) -> None:
    """However many there are, also such as do not fill the last SIMD value."""
    motion, weights = rng.normal(size=(3, 9, 6)), rng.normal(size=(9, 6, 60))
    whole = torque_regressor_adjoint(tree, *motion, weights)
    for count in range(9):
        np.testing.assert_array_equal(
            torque_regressor_adjoint(tree, *motion[:, :count], weights[:count]), whole[:, :count]
        )


def test_places_are_those_of_the_regressor(tree: RobotModel, rng: np.random.Generator) -> None:
    """Of 40 entries anywhere; what is zero by structure is not read."""
    motion = rng.normal(size=(3, 6, 6))
    places = np.full(360, -1)
    places[rng.choice(360, 40, replace=False)] = rng.permutation(40)
    places = places.reshape(6, 60)
    rows = np.full((40, 6), np.nan)
    write_torque_regressor(tree, *motion, places, rows)
    written = ~np.isnan(rows[:, 0])
    assert 10 < written.sum() < 40
    rows[written] = rng.normal(size=(written.sum(), 6))
    weights = np.where(places >= 0, rows.T[:, places], 0.0)
    found = placed_regressor_adjoint(tree, *motion, places, rows)
    np.testing.assert_array_equal(found, torque_regressor_adjoint(tree, *motion, weights))
    assert np.abs(found).max() > 1.0


def test_what_does_not_fit_is_refused(tree: RobotModel) -> None:
    motion = np.zeros((3, 4, 6))
    with refused("E-MODEL-010"):
        torque_regressor_adjoint(tree, motion[0], motion[1], motion[2, :3], np.zeros((4, 6, 60)))
    with refused("E-MODEL-011", "4, 6, 60"):
        torque_regressor_adjoint(tree, *motion, np.zeros((3, 6, 60)))
    with refused("E-MODEL-012", "4"):
        placed_regressor_adjoint(tree, *motion, np.full((6, 60), -1), np.zeros((2, 3)))
