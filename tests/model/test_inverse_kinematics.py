"""Joint positions for given points, against forward kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

from flexcal.model.kinematics import point_kinematics, reach_points
from flexcal.model.robot import RobotModel

LIMIT = 2.5


def _limits(model: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    return np.full(model.n, -LIMIT), np.full(model.n, LIMIT)


@pytest.mark.parametrize("name", ["tx90l", "ur5"])
def test_points_that_are_reached_are_reached_from_elsewhere(
    name: str, request: pytest.FixtureRequest, rng: np.random.Generator
) -> None:
    model = request.getfixturevalue(name)
    lower, upper = _limits(model)
    wanted = point_kinematics(model, rng.uniform(-2, 2, (200, 6)), jacobians=False).position
    q, reached = reach_points(model, wanted, rng.uniform(-2, 2, (200, 6)), lower, upper)
    assert reached.mean() > 0.8
    assert np.all((q >= lower) & (q <= upper))
    there = point_kinematics(model, q[reached], jacobians=False).position
    np.testing.assert_allclose(there, wanted[reached], atol=1e-4)


def test_a_point_out_of_reach_is_said_and_a_start_that_stands_there_stays(
    tx90l: RobotModel, rng: np.random.Generator
) -> None:
    lower, upper = _limits(tx90l)
    q = rng.uniform(-2, 2, (3, 6))
    here = point_kinematics(tx90l, q, jacobians=False).position
    found, reached = reach_points(tx90l, here + np.array([[0, 0, 0], [9, 0, 0], [0, 0, 0]]), q, lower, upper)
    np.testing.assert_array_equal(reached, [True, False, True])
    np.testing.assert_array_equal(found[[0, 2]], q[[0, 2]])


def test_wrong_number_of_joints(tx90l: RobotModel) -> None:
    with refused("E-MODEL-001", "5"):
        reach_points(tx90l, np.zeros((1, 3)), np.zeros((1, 5)), *_limits(tx90l))
