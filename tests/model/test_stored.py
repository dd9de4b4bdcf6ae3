"""Estimates on disk find their way into the robot."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.files.formats import write_estimates
from flexcal.model.robot import RobotModel, unit_of
from flexcal.model.robot.stored_estimates import apply_estimates
from flexcal.model.statics import static_equilibrium


def estimate(*parameters: Parameter) -> Estimate:
    size = len(parameters)
    return Estimate(
        parameters=Parameters(parameters),
        covariance=np.diag(np.arange(1.0, size + 1)) * 1e-8,
        rank=size,
        dropped=(),
        identifiable=(True,) * size,
        cost=1.0,
        chi2=2.0,
        degrees_of_freedom=10,
        status="converged",
        message="",
        iterations=1,
    )


@pytest.fixture
def robot(ur5: RobotModel, tmp_path: Path, examples: Path) -> Path:
    for name in ("robot.yaml", "ur5.urdf"):
        (tmp_path / name).write_bytes((examples / "ur5_tracker" / name).read_bytes())
    return tmp_path / "robot.yaml"


def test_values_and_covariance_come_with_the_robot(robot: Path) -> None:
    found = estimate(Parameter("elbow_joint.offset", "rad", 1e-3), Parameter("tool.length_x", "m", -2e-4))
    write_estimates(robot.parent / "estimates.yaml", "calibration", found)
    model = RobotModel.from_yaml(robot)
    assert model.value("elbow_joint.offset") == 1e-3 and model.value("tool.length_x") == -2e-4
    assert model.posterior.parameters.names == found.parameters.names
    assert np.array_equal(model.posterior.covariance, found.covariance)
    assert RobotModel.from_yaml(robot, estimates=False).value("elbow_joint.offset") == 0.0


def test_a_spring_that_robot_yaml_does_not_declare_comes_with_its_estimate(robot: Path) -> None:
    path = robot.parent / "estimates.yaml"
    spring = [
        Parameter("wrist_1_joint.drive.stiffness", "N m/rad", 5e4, scale="log"),
        Parameter("wrist_1_joint.drive.damping", "N m s/rad", 40.0, scale="log"),
        Parameter("wrist_1_joint.held_inertia", "kg m²", 0.1),
    ]
    write_estimates(path, "stiffness", estimate(*spring))
    rigid, model = RobotModel.from_yaml(robot, estimates=False), RobotModel.from_yaml(robot)
    assert not rigid.elastic
    assert [joint.name for joint in model.elastic] == ["wrist_1_joint"]
    assert model.value("wrist_1_joint.drive.stiffness") == 5e4
    assert not model.driven  # nothing says that its motor can be excited
    q = np.full((1, model.n), 0.4)
    twist = static_equilibrium(model, q).deflection[0, 3, 2]
    load = static_equilibrium(model, q).torque[0, 3]
    assert load != 0
    assert twist == pytest.approx(-load / 5e4, rel=1e-9)


def test_own_block_can_be_left_out(robot: Path) -> None:
    path = robot.parent / "estimates.yaml"
    write_estimates(path, "calibration", estimate(Parameter("elbow_joint.offset", "rad", 1e-3)))
    write_estimates(path, "stiffness", estimate(Parameter("forearm_link.mass", "kg", 3.0, scale="log")))
    nominal = RobotModel.from_yaml(robot, estimates=False)
    assert apply_estimates(nominal, path).value("forearm_link.mass") == 3.0
    model = apply_estimates(nominal, path, without="stiffness")
    assert model.value("elbow_joint.offset") == 1e-3
    assert model.value("forearm_link.mass") == nominal.value("forearm_link.mass")


def test_estimated_backlash_counts_as_declared(ur5: RobotModel, robot: Path) -> None:
    assert ur5.backlash_joints == ()
    write_estimates(
        robot.parent / "estimates.yaml",
        "calibration",
        estimate(Parameter("elbow_joint.backlash", "rad", 2e-5)),
    )
    assert RobotModel.from_yaml(robot).config.geometry.backlash == ("elbow_joint",)


def test_values_of_one_experiment_are_not_the_robots(robot: Path) -> None:
    found = estimate(
        Parameter("elbow_joint.viscous.pose_3", "N m s/rad", 5.0),
        Parameter("elbow_joint.offset", "rad", 1e-3),
    )
    write_estimates(robot.parent / "estimates.yaml", "stiffness", found)
    assert RobotModel.from_yaml(robot).posterior.parameters.names == ("elbow_joint.offset",)


def test_estimates_of_another_robot_are_refused(robot: Path) -> None:
    path = robot.parent / "estimates.yaml"
    write_estimates(path, "calibration", estimate(Parameter("joint_9.offset", "rad", 1e-3)))
    with refused("E-ROBOT-045", "estimates.yaml", "calibration", "joint_9.offset"):
        RobotModel.from_yaml(robot)


def test_later_block_wins_and_both_are_kept(robot: Path) -> None:
    path = robot.parent / "estimates.yaml"
    mass = Parameter("forearm_link.mass", "kg", 3.0, scale="log")
    write_estimates(path, "stiffness", estimate(mass, Parameter("wrist_1_link.mass", "kg", 1.5, scale="log")))
    write_estimates(path, "calibration", estimate(replace(mass, value=2.5)))
    model = RobotModel.from_yaml(robot)
    assert model.value("forearm_link.mass") == 2.5 and model.value("wrist_1_link.mass") == 1.5
    assert set(model.posterior.parameters.names) == {"forearm_link.mass", "wrist_1_link.mass"}


def test_springs_do_not_stand_on_links_that_no_body_can_be(examples: Path, tmp_path: Path) -> None:
    """Linear least squares may give an inertia that is none; a rigid robot takes it, as its torques are right."""
    elastic = (examples / "tx90l" / "robot.yaml").read_text()
    (tmp_path / "tx90l.urdf").write_bytes((examples / "tx90l" / "tx90l.urdf").read_bytes())
    robot = tmp_path / "robot.yaml"
    robot.write_text(elastic)
    nominal = RobotModel.from_yaml(robot)
    inertial = ("mass", "mc_x", "mc_y", "mc_z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
    values = {f"link_3.{key}": nominal.value(f"link_3.{key}") for key in inertial}
    path = tmp_path / "estimates.yaml"
    write_estimates(path, "dynamics", estimate(*(Parameter(n, unit_of(n), v) for n, v in values.items())))
    assert RobotModel.from_yaml(robot).value("link_3.Ixx") == pytest.approx(values["link_3.Ixx"])
    values["link_3.Ixx"] *= 9
    write_estimates(path, "dynamics", estimate(*(Parameter(n, unit_of(n), v) for n, v in values.items())))
    with refused("E-ROBOT-049", "estimates.yaml", "link_3"):
        RobotModel.from_yaml(robot)
    rigid = nominal.without_springs()
    assert apply_estimates(rigid, path).value("link_3.Ixx") == pytest.approx(values["link_3.Ixx"])


def test_an_estimate_in_another_unit_is_refused(robot: Path) -> None:
    path = robot.parent / "estimates.yaml"
    write_estimates(path, "calibration", estimate(Parameter("tool.length_x", "mm", -0.2)))
    with refused("E-ROBOT-046", "estimates.yaml", "tool.length_x", "mm", "m"):
        RobotModel.from_yaml(robot)
