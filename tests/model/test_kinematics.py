"""Forward kinematics and its Jacobians against Pinocchio, central differences and the chain written out in NumPy."""

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal.model.kinematics import point_kinematics
from flexcal.model.parts import axis_rotation
from flexcal.model.robot import GEOMETRY, RobotModel

NAMES_OF_GEOMETRY = [f"joint_{i}.{key}" for i in range(1, 7) for key in GEOMETRY] + [
    f"tool.{key}" for key in GEOMETRY
]


@pytest.fixture(params=["after", "before"])
def tx90l(request: pytest.FixtureRequest, tx90l: RobotModel) -> RobotModel:
    """The TX90L with bearings that turn with the child link, and with bearings fixed to the parent."""
    return tx90l.with_bearings(request.param)


@pytest.fixture
def crooked(tx90l: RobotModel) -> RobotModel:
    rng = np.random.default_rng(5)
    return tx90l.with_values({name: 1e-2 * rng.normal() for name in NAMES_OF_GEOMETRY})


def written_out(model: RobotModel, q: np.ndarray, deflection: np.ndarray) -> np.ndarray:
    """The chain of the parameters of docs/file-formats.md, one homogeneous matrix after the other."""

    def matrix(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
        result = np.eye(4)
        result[:3, :3], result[:3, 3] = rotation, translation
        return result

    x, y, z = np.eye(3)
    total, length = np.eye(4), np.zeros(3)
    for i, joint in enumerate(model.joints):
        offset, first, second = model.geometry.errors[i, :3]
        frame = model.springs.bearing_frames.get(
            i, np.column_stack([joint.normals[0], np.cross(joint.axis, joint.normals[0]), joint.axis])
        )
        tilt_x, tilt_y, twist = deflection[i]
        turn = axis_rotation(joint.normals[1], second) @ axis_rotation(joint.normals[0], first)
        spin, tilts = (
            axis_rotation(z, q[i] + offset + twist),
            axis_rotation(y, tilt_y) @ axis_rotation(x, tilt_x),
        )
        motion = tilts @ spin if model.bearings == "before" else spin @ tilts
        total = (
            total
            @ matrix(joint.rotation, joint.translation + length)
            @ matrix(turn @ frame @ motion @ frame.T, np.zeros(3))
        )
        length = model.geometry.errors[i, 3:]
    point = model.point()
    tool = (
        axis_rotation(y, model.geometry.tool[2])
        @ axis_rotation(x, model.geometry.tool[1])
        @ axis_rotation(z, model.geometry.tool[0])
    )
    total = total @ matrix(point.rotation @ tool, point.translation + length)
    return (total @ np.append(point.xyz + model.geometry.tool[3:], 1.0))[:3]


def test_nominal_kinematics_agree_with_pinocchio(tx90l: RobotModel) -> None:
    rng = np.random.default_rng(0)
    q = rng.uniform(-2, 2, (50, 6))
    other = pin.buildModelFromUrdf(str(tx90l.urdf))
    data, point = other.createData(), tx90l.point()
    frame = other.getFrameId(point.frame)
    ours = point_kinematics(tx90l, q)
    for k in range(len(q)):
        pin.framesForwardKinematics(other, data, q[k])
        np.testing.assert_allclose(ours.position[k], data.oMf[frame].act(point.xyz), atol=1e-12)
        np.testing.assert_allclose(ours.orientation[k], data.oMf[frame].rotation, atol=1e-12)


def test_the_chain_is_the_documented_one(crooked: RobotModel) -> None:
    rng = np.random.default_rng(1)
    q, deflection = rng.uniform(-2, 2, (20, 6)), 1e-2 * rng.normal(size=(20, 6, 3))
    ours = point_kinematics(crooked, q, deflection, jacobians=False).position
    np.testing.assert_allclose(
        ours, [written_out(crooked, *pair) for pair in zip(q, deflection, strict=True)], atol=1e-12
    )


def test_geometry_jacobian_agrees_with_central_differences(crooked: RobotModel) -> None:
    rng = np.random.default_rng(2)
    q, deflection = rng.uniform(-2, 2, (10, 6)), 1e-2 * rng.normal(size=(10, 6, 3))
    jacobian = point_kinematics(crooked, q, deflection).geometry_jacobian
    step = 1e-5
    for k, name in enumerate(NAMES_OF_GEOMETRY):
        ends = []
        for sign in (1, -1):
            moved = crooked.with_values({name: crooked.value(name) + sign * step})
            ends.append(point_kinematics(moved, q, deflection, jacobians=False))
        linear = (ends[0].position - ends[1].position) / (2 * step)
        np.testing.assert_allclose(jacobian[:, :3, k], linear, atol=1e-9, err_msg=name)
        spin = (
            (ends[0].orientation - ends[1].orientation)
            / (2 * step)
            @ np.swapaxes(point_kinematics(crooked, q, deflection).orientation, 1, 2)
        )
        np.testing.assert_allclose(
            jacobian[:, 3:, k],
            np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], 1),
            atol=1e-9,
            err_msg=name,
        )


def test_motion_jacobian_agrees_with_central_differences(crooked: RobotModel) -> None:
    rng = np.random.default_rng(3)
    q, deflection = rng.uniform(-2, 2, (10, 6)), 1e-2 * rng.normal(size=(10, 6, 3))
    jacobian = point_kinematics(crooked, q, deflection).motion_jacobian
    step = 1e-5
    for joint in range(6):
        for component in range(3):
            ends = []
            for sign in (1, -1):
                moved = deflection.copy()
                moved[:, joint, component] += sign * step
                ends.append(point_kinematics(crooked, q, moved, jacobians=False).position)
            np.testing.assert_allclose(
                jacobian[:, :3, joint, component], (ends[0] - ends[1]) / (2 * step), atol=1e-9
            )


def test_wrong_joint_count_is_one_sentence(tx90l: RobotModel) -> None:
    with refused("E-MODEL-001", "5", "tx90l", "6"):
        point_kinematics(tx90l, np.zeros((3, 5)))


def test_unknown_point_lists_the_known(tx90l: RobotModel) -> None:
    with refused("E-ROBOT-041", "ball", "smr"):
        point_kinematics(tx90l, np.zeros((1, 6)), point="ball")
