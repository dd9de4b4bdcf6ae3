"""Gravity moments across the joints against Pinocchio's centres of mass, and the tilt that they make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from flexcal.model.kinematics import point_kinematics
from flexcal.model.parts import Bearings
from flexcal.model.robot import LATERAL, RobotModel
from flexcal.model.statics import gravity_moments, static_equilibrium

Q = np.random.default_rng(4).uniform(-2, 2, (20, 6))


def test_moments_are_those_of_all_that_a_joint_carries(tx90l: RobotModel) -> None:
    """-(c - o) × m g about the misalignment axes, which turn with the parent link."""
    other = pin.buildModelFromUrdf(str(tx90l.urdf))
    data = other.createData()
    moments = gravity_moments(tx90l, Q, 0.0)
    for q, found in zip(Q, moments, strict=True):
        pin.centerOfMass(other, data, q, True)
        pin.forwardKinematics(other, data, q)
        for i, joint in enumerate(tx90l.joints):
            placement = data.oMi[other.parents[i + 1]] * other.jointPlacements[i + 1]
            arm = data.oMi[i + 1].rotation @ data.com[i + 1]
            moment = -np.cross(arm, data.mass[i + 1] * tx90l.gravity)
            np.testing.assert_allclose(found[i], joint.normals @ (placement.rotation.T @ moment), atol=1e-8)


@pytest.mark.parametrize("bearings", ["after", "before"])
def test_the_axis_tilts_as_a_misalignment_would(tx90l: RobotModel, bearings: Bearings) -> None:
    """At one pose, lateral compliance is a misalignment of minus compliance times moment, about axes fixed to the parent link."""
    rigid = tx90l.without_springs().with_bearings(bearings)
    loose = rigid.with_values({f"joint_{k}.{key}": 1e-6 for k in (1, 2, 4) for key in LATERAL})
    moments = gravity_moments(rigid, Q, 5.0)
    rest = static_equilibrium(loose, Q, 5.0)
    bent = point_kinematics(loose, Q, rest.deflection).position
    straight = point_kinematics(rigid, Q).position
    assert np.linalg.norm(bent - straight, axis=1).max() > 2e-4
    for k, q in enumerate(Q):
        tilts = {
            f"joint_{j}.misalignment_{axis}": -1e-6 * moments[k, j - 1, axis - 1]
            for j in (1, 2, 4)
            for axis in (1, 2)
        }
        expected = point_kinematics(rigid.with_values(tilts), q).position[0]
        np.testing.assert_allclose(bent[k], expected, atol=3e-7)


def test_the_other_arm_is_a_load(tmp_path: Path) -> None:
    """Two arms on a torso: what one arm does changes the moments at the torso, not at the other arm."""
    link = (
        '<link name="{0}"><inertial><origin xyz="0 0 0.2"/><mass value="{1}"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )
    joint = (
        '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="{3}"/><axis xyz="{4}"/>'
        '<limit lower="-3" upper="3" effort="9" velocity="9"/></joint>'
    )
    body = (
        '<link name="base"/>'
        + "".join(link.format(n, m) for n, m in (("torso", 10), ("left", 3), ("right", 2)))
        + joint.format("waist", "base", "torso", "0 0 1", "0 0 1")
        + joint.format("left_shoulder", "torso", "left", "0 0.2 0.4", "0 1 0")
        + joint.format("right_shoulder", "torso", "right", "0 -0.2 0.4", "0 1 0")
    )
    (tmp_path / "r.urdf").write_text(f'<robot name="r">{body}</robot>')
    (tmp_path / "robot.yaml").write_text("robot: r.urdf\npoints: {hand: {frame: left, xyz: [0, 0, 0.4]}}\n")
    robot = RobotModel.from_yaml(tmp_path / "robot.yaml")
    q = np.array([[0.4, 0.3, 0.0], [0.4, 0.3, 1.2]])
    moments = gravity_moments(robot, q)
    # in the base's frame: arms hang at 0.4 above the waist, 0.2 from their shoulders, and turn with the waist
    turn = np.array([[np.cos(0.4), -np.sin(0.4), 0], [np.sin(0.4), np.cos(0.4), 0], [0, 0, 1]])
    for k, right in enumerate((0.0, 1.2)):
        arms = {10: [0, 0, 0.2], 3: [0.2 * np.sin(0.3), 0.2, 0.6], 2: [0.2 * np.sin(right), -0.2, 0.6]}
        moment = sum(-np.cross(turn @ np.array(c), [0, 0, -9.81 * m]) for m, c in arms.items())
        np.testing.assert_allclose(moments[k, 0], robot.joints[0].normals @ moment, atol=1e-9)
    np.testing.assert_allclose(moments[0, 1], moments[1, 1], atol=1e-9)
