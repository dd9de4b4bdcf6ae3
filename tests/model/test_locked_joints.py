"""A gripper on the arm: its joints, one of which mimics the other, stand still where robot.yaml locks them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal.design.scene import CollisionChecker
from flexcal.export import export_urdf
from flexcal.model.robot import RobotModel

LINK = """<link name="{0}"><inertial><origin xyz="0.01 -0.02 {1}"/><mass value="{2}"/>
  <inertia ixx="0.04" ixy="0.005" ixz="-0.003" iyy="0.05" iyz="0.002" izz="0.03"/></inertial>{3}</link>"""
JOINT = '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="{4}" rpy="0 0 0.5"/>{5}</joint>'
MOVES = '<axis xyz="{0}"/><limit lower="0" upper="2" effort="9" velocity="1"/>{1}'
MESH = '<collision><geometry><mesh filename="package://arm_description/meshes/finger.stl"/></geometry></collision>'
POST = '<collision><origin xyz="{0} 0.5 0.5"/><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
LOCKED = {"turn": 0.3, "slide": 0.02, "follow": 0.03}


def _urdf(gripper: tuple[str, str, str]) -> str:
    parts = [
        f'<link name="base">{POST.format("1")}</link>',
        LINK.format("boom", 0.5, 4, ""),
        LINK.format("hand", 0.1, 0.7, ""),
        LINK.format("left", 0.01, 0.1, ""),
        LINK.format("right", 0.01, 0.2, MESH),
        JOINT.format("shoulder", "revolute", "base", "boom", "0 0 0.3", MOVES.format("0 1 0", "")),
        *gripper,
    ]
    return f'<robot name="arm">{"".join(parts)}</robot>'


MOVING = (
    JOINT.format("turn", "continuous", "boom", "hand", "0 0 1", '<axis xyz="0 0 1"/>'),
    JOINT.format("slide", "prismatic", "hand", "left", "0 0 0.1", MOVES.format("0 1 0", "")),
    JOINT.format("follow", "prismatic", "hand", "right", "0 0 0.1", MOVES.format("0 -1 0", '<mimic joint="slide"/>')),
)  # fmt: skip
FIXED = (
    JOINT.format("turn", "fixed", "boom", "hand", "0 0 1", "").replace("0 0 0.5", "0 0 0.8"),
    JOINT.format("slide", "fixed", "hand", "left", f"{-0.02 * np.sin(0.5)} {0.02 * np.cos(0.5)} 0.1", ""),
    JOINT.format("follow", "fixed", "hand", "right", f"{0.03 * np.sin(0.5)} {-0.03 * np.cos(0.5)} 0.1", ""),
)


def _robot(folder: Path, gripper: tuple[str, str, str], locked: dict[str, float]) -> RobotModel:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.urdf").write_text(_urdf(gripper))
    (folder / "robot.yaml").write_text(
        f"robot: arm.urdf\nlocked: {locked}\npoints: {{tip: {{frame: right, xyz: [0, 0, 0.1]}}}}\n".replace(
            "'", ""
        )
    )
    return RobotModel.from_yaml(folder / "robot.yaml")


def test_the_locked_gripper_is_the_fixed_one(tmp_path: Path) -> None:
    ours, other = _robot(tmp_path / "a", MOVING, LOCKED), _robot(tmp_path / "b", FIXED, {})
    assert ours.joint_names == other.joint_names == ("shoulder",)
    for one, two in (
        (ours.links.mass, other.links.mass),
        (ours.links.com, other.links.com),
        (ours.links.inertia, other.links.inertia),
    ):
        np.testing.assert_allclose(one, two, rtol=0, atol=1e-14)
    np.testing.assert_allclose(ours.point().translation, other.point().translation, rtol=0, atol=1e-15)
    np.testing.assert_allclose(ours.point().rotation, other.point().rotation, rtol=0, atol=1e-15)


def test_meshes_of_a_package_above_the_urdf_stand_where_the_joint_is_locked(tmp_path: Path) -> None:
    package = tmp_path / "source" / "arm_description"
    ours = _robot(package / "urdf", MOVING, {**LOCKED, "follow": 1.5})
    with refused("E-DESIGN-036"):
        CollisionChecker(ours)
    corners = 0.05 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {:e} {:e} {:e}\n".format(*corners[k]) for k in face)
        + "endloop\nendfacet\n"
        for face in ((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2))
    )
    (package / "meshes").mkdir()
    (package / "meshes" / "finger.stl").write_text(f"solid finger\n{facets}endsolid finger\n")
    other = pin.buildModelFromUrdf(str(ours.urdf))
    data = other.createData()
    checker = CollisionChecker(ours, floor=None)
    (finger,) = [shape for shape in checker.shapes if shape.joint == 0]
    q = pin.neutral(other)
    q[other.joints[other.getJointId("turn")].idx_q :][:2] = np.cos(0.3), np.sin(0.3)
    q[other.joints[other.getJointId("slide")].idx_q] = 0.02
    q[other.joints[other.getJointId("follow")].idx_q] = 1.5
    pin.framesForwardKinematics(other, data, q)
    place = (
        data.oMi[other.getJointId("shoulder")].inverse()
        * data.oMf[other.getFrameId("right", pin.FrameType.BODY)]
    )
    np.testing.assert_allclose(finger.translation, place.translation, rtol=0, atol=1e-14)
    np.testing.assert_allclose(finger.rotation, place.rotation, rtol=0, atol=1e-14)


def test_an_exported_gripper_weighs_what_was_found(tmp_path: Path) -> None:
    ours = _robot(tmp_path, MOVING, LOCKED)
    found = ours.with_values({"boom.mass": 6.0, "boom.com_x": 0.04})
    export_urdf(found, tmp_path / "found.urdf")
    (tmp_path / "robot.yaml").write_text(f"robot: found.urdf\nlocked: {LOCKED}\n".replace("'", ""))
    again = RobotModel.from_yaml(tmp_path / "robot.yaml")
    for one, two in (
        (found.links.mass, again.links.mass),
        (found.links.com, again.links.com),
        (found.links.inertia, again.links.inertia),
    ):
        np.testing.assert_allclose(two, one, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("locked", "refusal"),
    [
        ({"slide": 0.02}, ["E-URDF-042", "follow", "slide"]),
        ({**LOCKED, "slde": 0.02}, ["E-URDF-025", "slde", "shoulder", "slide"]),
        ({**LOCKED, "slide": 2.1}, ["E-URDF-026", "slide", "2.1", "0", "2"]),
        ({**LOCKED, "shoulder": 1}, ["E-URDF-024"]),
    ],
)
def test_what_cannot_be_locked_is_said(tmp_path: Path, locked: dict[str, float], refusal: list[str]) -> None:
    with refused(*refusal):
        _robot(tmp_path, MOVING, locked)
