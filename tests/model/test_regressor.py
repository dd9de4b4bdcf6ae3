"""The torque regressor against Pinocchio's, and against its RNEA."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal.model.robot import RobotModel
from flexcal.model.torques import inertial_names, inertial_parameters, torque_regressor

PINOCCHIO_ORDER = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]  # its Iyy comes before Ixz


@pytest.fixture(params=["tx90l", "ur5", "tree"])
def robot(request: pytest.FixtureRequest) -> RobotModel:
    return request.getfixturevalue(request.param)


def reference(robot: RobotModel) -> pin.Model:
    model = pin.buildModelFromUrdf(str(Path(robot.urdf)))
    model.gravity = pin.Motion(robot.gravity, np.zeros(3))
    return model


def states(robot: RobotModel, rng: np.random.Generator, samples: int = 7) -> np.ndarray:
    return rng.normal(size=(3, samples, robot.n))


def test_the_regressor_is_pinocchios(robot: RobotModel, rng: np.random.Generator) -> None:
    model = reference(robot)
    data = model.createData()
    q, dq, ddq = states(robot, rng)
    found = torque_regressor(robot, q, dq, ddq)
    columns = np.concatenate([10 * i + np.array(PINOCCHIO_ORDER) for i in range(robot.n)])
    for sample, state in enumerate(zip(q, dq, ddq, strict=True)):
        expected = np.array(pin.computeJointTorqueRegressor(model, data, *state))[:, columns]
        assert np.abs(found[sample] - expected).max() < 1e-12 * np.abs(expected).max()


def test_times_the_parameters_it_is_rnea(robot: RobotModel, rng: np.random.Generator) -> None:
    model = reference(robot)
    data = model.createData()
    q, dq, ddq = states(robot, rng)
    torques = torque_regressor(robot, q, dq, ddq) @ inertial_parameters(robot)
    expected = np.array([pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])
    assert np.abs(torques - expected).max() < 1e-12 * np.abs(expected).max()


def test_geometric_errors_count(tx90l: RobotModel, rng: np.random.Generator) -> None:
    """An offset is a shifted q; a longer link 5 gives link 6 another lever about joint 5."""
    q, dq, ddq = states(tx90l, rng)
    moved = torque_regressor(tx90l.with_values({"joint_2.offset": 0.1}), q, dq, ddq)
    shifted = q + 0.1 * np.eye(6)[1]
    np.testing.assert_allclose(moved, torque_regressor(tx90l, shifted, dq, ddq), atol=1e-12)
    longer = torque_regressor(tx90l.with_values({"joint_5.length_x": 0.1}), q, dq, ddq)
    change = np.abs(longer - torque_regressor(tx90l, q, dq, ddq)).max(axis=(0, 2))
    assert change[4] > 1e-3


def test_full_inertials_can_be_set_by_name(tx90l: RobotModel) -> None:
    """All ten of a link at once, in any order: what the identification of dynamics gives back."""
    wanted = {
        "link_3.Ixx": 2.0,
        "link_3.mc_y": 0.7,
        "link_3.mass": 9.0,
        "link_3.mc_x": -0.2,
        "link_3.Ixz": 0.1,
    }
    changed = tx90l.with_values(wanted)
    assert {name: changed.value(name) for name in wanted} == pytest.approx(wanted, rel=1e-14)
    assert changed.value("link_3.com_y") == pytest.approx(0.7 / 9.0)
    assert len(inertial_names(tx90l)) == 60


def test_a_massless_link_has_no_first_moment(tx90l: RobotModel) -> None:
    with refused("E-ROBOT-044", "link_3"):
        tx90l.with_values({"link_3.mass": 0.0, "link_3.mc_x": 0.1})


def test_batches_of_different_length_are_refused(tx90l: RobotModel) -> None:
    with refused("E-MODEL-010"):
        torque_regressor(tx90l, np.zeros((3, 6)), np.zeros((3, 6)), np.zeros((2, 6)))
