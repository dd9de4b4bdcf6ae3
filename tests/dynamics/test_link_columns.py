"""The columns that each joint keeps give the others back, and the equations nothing is taken from."""

import numpy as np
import pytest

from flexcal.data.recordings import Decimation
from flexcal.dynamics.inverse_model import CLASSIC, Observation
from flexcal.dynamics.regression import experiment_system
from flexcal.dynamics.signals import Motion, Window
from flexcal.model.robot import RobotModel


@pytest.fixture(params=["tx40", "tx90l", "ur5", "tree"])
def robot(request: pytest.FixtureRequest) -> RobotModel:
    return request.getfixturevalue(request.param)


def test_the_kept_columns_give_back_all(robot: RobotModel, rng: np.random.Generator) -> None:
    """Against the regressor with every column (which is Pinocchio's) at states that did not choose them."""
    observation = Observation(robot, CLASSIC)
    q, dq, ddq, torque = rng.normal(size=(4, 50, robot.n))
    motion = Motion(np.arange(50.0), q, dq, ddq, torque)
    parts = np.split(observation.reduced(motion), np.cumsum(observation.widths)[:-1])
    every = zip(observation.columns(motion), observation.projection, parts, torque.T, strict=True)
    for whole, spread, part, own in every:
        assert len(part) - 1 < len(whole)
        np.testing.assert_allclose(spread.T @ part[:-1], whole, rtol=0, atol=1e-9 * np.abs(whole).max())
        np.testing.assert_array_equal(part[-1], own)


def test_as_many_as_the_closed_form_counts(ur5: RobotModel, tx90l: RobotModel) -> None:
    """Seven for every link that a turning joint moves, as three regroup into the link before (Gautier & Khalil 1990)."""
    for robot in (ur5, tx90l):
        drives = 4  # of each joint, and the torque
        found = [width - drives - 1 for width in Observation(robot, CLASSIC).widths]
        assert found[1:] == [35, 28, 21, 14, 7]
        assert found[0] < 36


def test_factors_stand_for_the_equations(robot: RobotModel, rng: np.random.Generator) -> None:
    observation = Observation(robot, CLASSIC)
    q, dq, ddq, torque = rng.normal(size=(4, 2500, robot.n))
    motion = Motion(0.01 * np.arange(2500), q, dq, ddq, torque)
    system = experiment_system(observation, motion, Decimation(1), Window(), mask_standstill=False, batches=7)
    assert [batch.rows for batch in system.batches] == [358] * 6 + [352]
    for joint, whole in enumerate(observation.columns(motion)):
        dense = np.vstack([whole, torque[:, joint]])
        stack = np.vstack([batch.factors[joint] for batch in system.batches])
        expected = dense @ dense.T
        size = np.sqrt(np.diag(expected))
        np.testing.assert_allclose(
            (stack.T @ stack) / expected.max(), expected / expected.max(), rtol=0, atol=1e-10
        )
        np.testing.assert_allclose(np.linalg.norm(stack, axis=0), size, rtol=1e-9, atol=1e-9 * size.max())
