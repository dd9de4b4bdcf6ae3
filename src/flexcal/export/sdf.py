"""SDFormat of a calibrated robot for Gazebo: links at their joints, poses relative to the parent link."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.export.following_joints import joint_values, relation_remarks
from flexcal.export.representation_error import AT_REST, ToolMap
from flexcal.export.transforms import XYZ_RPY, from_xyz_rpy, shifted, transform, turned, xyz_rpy
from flexcal.export.urdf_inertials import bodiless_links, bodiless_remark
from flexcal.export.written_file import RenderedModel
from flexcal.model.kinematics import link_placement, point_placement
from flexcal.model.parts import Inertia, Joint
from flexcal.model.robot import RobotModel

VERSION = "1.7"
BASE = "base"
_FIXED = "world_to_base"
_MOMENTS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def render_sdf(model: RobotModel, nominal: RobotModel) -> RenderedModel:
    """The robot as SDFormat 1.7: geometry, inertials, viscous and Coulomb friction, a frame per point, the base fixed to the world.

    Raises `FlexcalError` where two links, joints or points have one name, or one has that of the base or the world.
    """
    moving = [name for joint in model.joints for name in (joint.link, joint.name)]
    names = ["world", BASE, _FIXED, *moving, *model.points]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise FlexcalError(
            "E-EXPORT-004",
            f"the name '{twice[0]}' would stand for two things in the SDF; rename the point, link or joint.",
        )
    bodiless = bodiless_links(model, nominal.inertias)
    root = ET.Element("sdf", version=VERSION)
    body = ET.SubElement(root, "model", name=model.name)
    ET.SubElement(body, "link", name=BASE)
    fixed = ET.SubElement(body, "joint", name=_FIXED, type="fixed")
    ET.SubElement(fixed, "parent").text = "world"
    ET.SubElement(fixed, "child").text = BASE
    for i, joint in enumerate(model.joints):
        parent = BASE if joint.parent < 0 else model.joints[joint.parent].link
        _add_link(
            body, model, i, parent, nominal.inertias[i] if joint.link in bodiless else model.inertias[i]
        )
        _add_joint(body, model, i, parent)
    for name in model.points:
        carrier, position, rotation = point_placement(model, name)
        frame = ET.SubElement(body, "frame", name=name, attached_to=model.joints[carrier].link)
        ET.SubElement(frame, "pose").text = _pose(position, rotation)
    ET.indent(root)
    text = '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
    return RenderedModel(
        text,
        sdf_tool(model, text),
        AT_REST,
        "<!--",
        remarks=(
            "Fixed and locked links are merged into those that carry them, rotors and payload are left out.",
            "Looks and collision bodies stay in the URDF.",
            *bodiless_remark(bodiless),
            *relation_remarks(model, f"SDFormat {VERSION}", mimics=False),
        ),
    )


def sdf_tool(model: RobotModel, text: str) -> ToolMap:
    """Position of the first point of `model` from the SDF `text` alone."""
    body = ET.fromstring(text).find("model")
    assert body is not None
    joints = {
        joint.findtext("child", ""): joint for joint in body.findall("joint") if joint.get("type") != "fixed"
    }
    poses = {
        link.get("name", ""): _matrix(link.findtext("pose", "0 0 0 0 0 0")) for link in body.findall("link")
    }
    frames = {frame.get("name", ""): frame for frame in body.findall("frame")}

    def positions(q: np.ndarray) -> np.ndarray:
        q = joint_values(model, q)
        frame = frames[model.point().name]
        at = np.broadcast_to(_matrix(frame.findtext("pose", "")), (len(q), 4, 4))
        link = frame.get("attached_to", "")
        while link in joints:
            joint = joints[link]
            axis = np.array([float(v) for v in joint.findtext("axis/xyz", "").split()])
            move = shifted if joint.get("type") == "prismatic" else turned
            at = poses[link] @ move(axis, q[:, model.joint_index(joint.get("name", ""))]) @ at
            link = joint.findtext("parent", "")
        return at[:, :3, 3]

    return positions


def _add_link(body: ET.Element, model: RobotModel, i: int, parent: str, inertia: Inertia) -> None:
    joint = model.joints[i]
    link = ET.SubElement(body, "link", name=joint.link)
    ET.SubElement(link, "pose", relative_to=parent).text = _pose(*link_placement(model, i))
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "pose").text = _pose(inertia.com, np.eye(3))
    ET.SubElement(inertial, "mass").text = repr(float(inertia.mass))
    moments = ET.SubElement(inertial, "inertia")
    for key, place in _MOMENTS.items():
        ET.SubElement(moments, key).text = repr(float(inertia.inertia[place]))


def _add_joint(body: ET.Element, model: RobotModel, i: int, parent: str) -> None:
    joint = model.joints[i]
    element = ET.SubElement(body, "joint", name=joint.name, type=joint.kind)
    ET.SubElement(element, "parent").text = parent
    ET.SubElement(element, "child").text = joint.link
    axis = ET.SubElement(element, "axis")
    ET.SubElement(axis, "xyz").text = " ".join(repr(float(value)) for value in joint.axis)
    limit = ET.SubElement(axis, "limit")
    for key, value in _limits(joint).items():
        if np.isfinite(value):
            ET.SubElement(limit, key).text = repr(float(value))
    known = {"damping": model.drives.viscous[i], "friction": model.drives.coulomb[i]}
    dynamics = ET.SubElement(axis, "dynamics")
    for key, value in known.items():
        ET.SubElement(dynamics, key).text = repr(float(value) if np.isfinite(value) else 0.0)


def _limits(joint: Joint) -> dict[str, float]:
    return {"lower": joint.lower, "upper": joint.upper, "effort": joint.effort, "velocity": joint.velocity}


def _pose(position: np.ndarray, rotation: np.ndarray) -> str:
    return " ".join(repr(value) for value in xyz_rpy(transform(position, rotation)).values())


def _matrix(pose: str) -> np.ndarray:
    return from_xyz_rpy(dict(zip(XYZ_RPY, map(float, pose.split()), strict=True)))
