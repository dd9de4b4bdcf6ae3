"""SDF and the kinematics YAML: each read by a small reader of its own and held against Pinocchio on the exported URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import yaml
from panda import panda
from refusals import refused
from scipy.spatial.transform import Rotation

from flexcal.export.sdf import render_sdf
from flexcal.export.universal_robots import LINKS, render_kinematics
from flexcal.model.robot import RobotModel

UR5 = {
    "shoulder": (0, 0, 0.089159, 0, 0, 0),
    "upper_arm": (0, 0, 0, np.pi / 2, 0, 0),
    "forearm": (-0.425, 0, 0, 0, 0, 0),
    "wrist_1": (-0.39225, 0, 0.10915, 0, 0, 0),
    "wrist_2": (0, -0.09465, 0, np.pi / 2, 0, 0),
    "wrist_3": (0, 0.0823, 0, -np.pi / 2, 0, 0),
}
"""default_kinematics.yaml of the UR5 (wrist_3 there in the other angles of the same rotation: π/2, π, π)."""


FIXED = """<joint name="{0}-{1}" type="fixed"><parent link="{0}"/><child link="{1}"/><origin xyz="0 0 0" rpy="{2}"/></joint>"""
REVOLUTE = """<joint name="{1}_joint" type="revolute"><parent link="{0}"/><child link="{1}"/><origin xyz="{2}" rpy="{3}"/>
  <axis xyz="0 0 1"/><limit lower="-6.28" upper="6.28" effort="1" velocity="1"/></joint>"""


def placed(six: list[float]) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("xyz", six[3:]).as_matrix()
    matrix[:3, 3] = six[:3]
    return matrix


def turned(axis: list[float], angle: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(angle * np.array(axis)).as_matrix()
    return matrix


def read_sdf(text: str, point: str, q: dict[str, float]) -> np.ndarray:
    """A target's frame in the model's, as SDFormat says: a pose is relative to what `relative_to` names."""
    model = ET.fromstring(text).find("model")
    poses = {link.attrib["name"]: link.find("pose") for link in model.findall("link")}
    moved = {
        joint.findtext("child"): joint for joint in model.findall("joint") if joint.get("type") != "fixed"
    }

    def where(link: str) -> np.ndarray:
        pose = poses[link]
        if pose is None:
            return np.eye(4)
        at = where(pose.attrib["relative_to"]) @ placed([float(v) for v in pose.text.split()])
        axis = [float(v) for v in moved[link].findtext("axis/xyz").split()]
        return at @ turned(axis, q[moved[link].attrib["name"]])

    frame = next(f for f in model.findall("frame") if f.attrib["name"] == point)
    return where(frame.attrib["attached_to"]) @ placed([float(v) for v in frame.findtext("pose").split()])


@pytest.mark.parametrize("name", ["tx90l", "ur5"])
def test_sdf_stands_where_pinocchio_does(
    name: str, request: pytest.FixtureRequest, erroneous, pinocchio_of, rng: np.random.Generator
) -> None:
    nominal: RobotModel = request.getfixturevalue(name)
    model = erroneous(nominal)
    text = render_sdf(model, nominal).text
    q = rng.uniform(-2, 2, (20, 6))
    ours = np.array([read_sdf(text, "smr", dict(zip(model.joint_names, own, strict=True))) for own in q])
    np.testing.assert_allclose(ours, pinocchio_of(model)(q), atol=1e-12)
    masses = [float(e.text or "") for e in ET.fromstring(text).iter("mass")]
    np.testing.assert_allclose(masses, model.links.mass)


def test_the_nominal_ur5_has_the_makers_numbers(ur5: RobotModel) -> None:
    read = yaml.safe_load(render_kinematics(ur5, ur5).text)["kinematics"]
    for link, expected in UR5.items():
        ours = placed([read[link][key] for key in ("x", "y", "z", "roll", "pitch", "yaw")])
        np.testing.assert_allclose(ours, placed(list(expected)), atol=1e-9)
    assert read["hash"].startswith("flexcal_")


def test_the_makers_own_description_keeps_its_frames(tmp_path: Path) -> None:
    """A URDF as the description makes it, all joints about z and half a turn at the base, gives back the numbers it was made of."""
    chain = ["base_link_inertia", *LINKS]
    parts = [f'<link name="{name}"/>' for name in ("base_link", *chain, "tool0")]
    parts.append(FIXED.format("base_link", "base_link_inertia", f"0 0 {np.pi}"))
    parts.append(FIXED.format("wrist_3", "tool0", "0 0 0"))
    parts += [
        REVOLUTE.format(parent, link, *(" ".join(map(str, part)) for part in (UR5[link][:3], UR5[link][3:])))
        for parent, link in zip(chain, LINKS, strict=False)
    ]
    (tmp_path / "ur.urdf").write_text(f'<robot name="ur">{"".join(parts)}</robot>')
    (tmp_path / "robot.yaml").write_text(
        "robot: ur.urdf\npoints:\n  smr: {frame: tool0, xyz: [0.01, 0, 0.05]}\n"
    )
    model = RobotModel.from_yaml(tmp_path / "robot.yaml")
    read = yaml.safe_load(render_kinematics(model, model).text)["kinematics"]
    for link in LINKS:
        ours = placed([read[link][key] for key in ("x", "y", "z", "roll", "pitch", "yaw")])
        np.testing.assert_allclose(ours, placed(list(UR5[link])), atol=1e-12)


def test_calibrated_kinematics_stand_where_pinocchio_does(
    ur5: RobotModel, erroneous, pinocchio_of, rng: np.random.Generator
) -> None:
    """From base_link, half a turn before the first link; the tool as the remarks say."""
    model = erroneous(ur5)
    rendered = render_kinematics(model, ur5)
    read = yaml.safe_load(rendered.text)["kinematics"]
    links = [placed([read[link][key] for key in ("x", "y", "z", "roll", "pitch", "yaw")]) for link in LINKS]
    tool = np.eye(4)
    tool[:3, 3] = rendered.table["tool"]["xyz"]
    tool[:3, :3] = Rotation.from_rotvec(rendered.table["tool"]["rotation_vector"]).as_matrix()
    q = rng.uniform(-2, 2, (20, 6))
    ours = []
    for own in q:
        at = turned([0, 0, 1], np.pi)
        for link, angle in zip(links, own, strict=True):
            at = at @ link @ turned([0, 0, 1], angle)
        ours.append(at @ tool)
    np.testing.assert_allclose(np.array(ours), pinocchio_of(model)(q), atol=1e-12)


def test_seven_axes_have_no_kinematics_file(tmp_path: Path) -> None:
    model = panda(tmp_path)
    with refused("E-EXPORT-005"):
        render_kinematics(model, model)


def test_names_stand_for_one_thing_in_sdf(tx90l: RobotModel) -> None:
    from dataclasses import replace

    with refused("E-EXPORT-004", "link_3"):
        render_sdf(replace(tx90l, points={"link_3": replace(tx90l.point(), name="link_3")}), tx90l)
