"""A kinematic tree: two arms on one waist, written right before left, which is not the order of the alphabet."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from flexcal.calibration.fit import fit_geometry
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.design.scene import CollisionChecker
from flexcal.export import export_urdf
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import GEOMETRY, RobotModel
from flexcal.model.statics import gravity_torque
from flexcal.model.vibration import ElasticArm

LINK = (
    '<link name="{0}"><inertial><origin xyz="0.1 0.02 0"/><mass value="2"/>'
    '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>'
    '<collision><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.1 0.1"/></geometry></collision></link>'
)
JOINT = (
    '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="{3}" rpy="0.1 0.2 0.3"/>'
    '<axis xyz="{4}"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
)
JOINTS = (
    ("waist", "base", "torso", "0 0 0.5", "0 0 1"),
    ("right_1", "torso", "right_upper", "0 -0.1 0.4", "0 1 0"),
    ("right_2", "right_upper", "right_lower", "0.4 0 0", "1 0 0"),
    ("left_1", "torso", "left_upper", "0 0.1 0.4", "0 1 0"),
    ("left_2", "left_upper", "left_lower", "0.4 0 0", "0 0 1"),
)
TIPS = {"right": "right_lower", "left": "left_lower"}
TIP = np.array([0.3, 0.1, 0.2])
NAMES = ("waist", "right_1", "right_2", "left_1", "left_2")


@pytest.fixture(scope="module")
def torso(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    folder = tmp_path_factory.mktemp("torso")
    links = [LINK.format(name) for name in ("base", *(joint[2] for joint in JOINTS))]
    joints = [JOINT.format(*joint) for joint in JOINTS]
    (folder / "torso.urdf").write_text(f'<robot name="torso">{"".join(links + joints)}</robot>')
    points = ", ".join(f"{name}: {{frame: {frame}, xyz: {TIP.tolist()}}}" for name, frame in TIPS.items())
    (folder / "robot.yaml").write_text(f"robot: torso.urdf\npoints: {{{points}}}\n")
    return RobotModel.from_yaml(folder / "robot.yaml")


def in_pinocchio(model: RobotModel, q: np.ndarray) -> tuple[pin.Model, np.ndarray]:
    """Pinocchio's own robot, and `q` (samples, n) in the order of its joints."""
    other = pin.buildModelFromUrdf(str(model.urdf))
    return other, q[:, [model.joint_index(name) for name in list(other.names)[1:]]]


def test_joints_stand_as_the_file_has_them(torso: RobotModel) -> None:
    assert torso.joint_names == NAMES
    assert [joint.parent for joint in torso.joints] == [-1, 0, 1, 0, 3]


@pytest.mark.parametrize("tip", TIPS)
def test_both_arms_lie_where_pinocchio_has_them(
    torso: RobotModel, rng: np.random.Generator, tip: str
) -> None:
    q = rng.uniform(-2, 2, (20, 5))
    other, theirs = in_pinocchio(torso, q)
    data = other.createData()
    ours = point_kinematics(torso, q, point=tip)
    for k, row in enumerate(theirs):
        pin.framesForwardKinematics(other, data, row)
        expected = data.oMf[other.getFrameId(TIPS[tip])].act(TIP)
        np.testing.assert_allclose(ours.position[k], expected, atol=1e-12)
    still = [i for i, name in enumerate(NAMES) if name.startswith("right" if tip == "left" else "left")]
    moves = np.abs(ours.geometry_jacobian[:, :3, : 6 * torso.n]).max(axis=(0, 1)).reshape(torso.n, 6)
    assert (moves[still] == 0).all() and (np.delete(moves, still, axis=0).max(axis=1) > 0.3).all()


def test_gravity_acts_on_the_joint_that_carries_the_load(torso: RobotModel, rng: np.random.Generator) -> None:
    q = rng.uniform(-2, 2, (20, 5))
    other, theirs = in_pinocchio(torso, q)
    data = other.createData()
    expected = np.array([pin.computeGeneralizedGravity(other, data, row) for row in theirs])
    sorted_names = list(other.names)[1:]
    ours = gravity_torque(torso, q)
    np.testing.assert_allclose(ours, expected[:, [sorted_names.index(n) for n in NAMES]], atol=1e-12)
    arm = ElasticArm(torso)
    at = arm.configuration(q[0], np.zeros((5, 3)))
    load = pin.computeGeneralizedGravity(arm.model, arm.data, at)[arm.joint_velocity]
    np.testing.assert_allclose(load, ours[0], atol=1e-12)


def test_the_arms_hit_each_other_where_pinocchio_says(torso: RobotModel, rng: np.random.Generator) -> None:
    checker = CollisionChecker(torso, floor=None, margin=0.0)
    links = ("base", *(joint[2] for joint in JOINTS))
    assert {shape.name: shape.joint for shape in checker.shapes} == {
        f"{link}_0": i - 1 for i, link in enumerate(links)
    }
    q = rng.uniform(-3, 3, (600, 5))
    other, theirs = in_pinocchio(torso, q)
    geometry = pin.buildGeomFromUrdf(other, str(torso.urdf), pin.GeometryType.COLLISION)
    pair = ("left_lower_0", "right_lower_0")
    geometry.addCollisionPair(pin.CollisionPair(*map(geometry.getGeometryId, pair)))
    data, touching = other.createData(), geometry.createData()
    expected = [pin.computeCollisions(other, data, geometry, touching, row, True) for row in theirs]
    assert 10 < sum(expected) < 300
    assert [pair in map(tuple, map(sorted, checker.colliding(row))) for row in q] == expected


def test_points_on_both_arms_calibrate_the_tree(
    torso: RobotModel, rng: np.random.Generator, tmp_path: Path
) -> None:
    """Without noise every point is met, on fresh poses too; the exported URDF is the same robot."""
    truth = {f"{joint}.{key}": 5e-4 * rng.normal() for joint in NAMES for key in GEOMETRY}
    robot = torso.with_values(truth)
    q, names = rng.uniform(-2, 2, (80, 5)), np.array(["right", "left"] * 40)
    poses = PoseSet(
        q=q, position=np.zeros((80, 3)), sigma=np.full((80, 3), 1e-5), torque=None, payload=None,
        target=names, station=np.full(80, "tracker"), temperature=None, pose=np.arange(80),
    )  # fmt: skip
    seen = replace(poses, position=predict_measurements(robot, poses).position)
    fit = fit_geometry(torso, seen.subset(slice(0, 60)), terms=("kinematic",))
    fresh = seen.subset(slice(60, 80))
    np.testing.assert_allclose(predict_measurements(fit.model, fresh).position, fresh.position, atol=1e-6)
    before = predict_measurements(torso, fresh).position
    assert np.linalg.norm(before - fresh.position, axis=1).mean() > 3e-4
    other = pin.buildModelFromUrdf(str(export_urdf(fit.model, tmp_path / "calibrated.urdf").path))
    _, theirs = in_pinocchio(torso, q)
    data = other.createData()
    for tip in TIPS:
        ours = point_kinematics(fit.model, q, point=tip, jacobians=False).position
        for k, row in enumerate(theirs):
            pin.framesForwardKinematics(other, data, row)
            np.testing.assert_allclose(data.oMf[other.getFrameId(tip)].translation, ours[k], atol=1e-12)
