"""URDF of a calibrated robot: calibrated joint origins and tool, identified inertials."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.export.following_joints import followed_joints, joint_values, mimicked, relation_remarks
from flexcal.export.geometry_fit import render_representable
from flexcal.export.representation_error import AT_REST, ToolMap
from flexcal.export.urdf_inertials import bodiless_remark, write_inertials
from flexcal.export.written_file import ExportedFile, RenderedModel, write_rendered
from flexcal.files.transaction import open_regular
from flexcal.model.kinematics import link_placement, point_placement
from flexcal.model.parts import rotation_rpy, rpy_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import LARGEST_URDF


def export_urdf(model: RobotModel, path: str | Path) -> ExportedFile:
    """Write the URDF of a robot and measure the error due to the terms that the format lacks; see `render_urdf`.

    Where it lacks some, the geometry is that with which the points come nearest to those of the robot at rest.

    Parameters
    ----------
    model : RobotModel
        The robot, calibrated or not.
    path : str or Path
        File to write.

    Returns
    -------
    ExportedFile
        The `path`, the error `loss`, and `remarks`; as `str` one paragraph.

    Raises
    ------
    FlexcalError
        Where a point's name is already a link's, and where the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from flexcal import RobotModel, export_urdf
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     export_urdf(model, f"{folder}/ur5.urdf").lost
    ()
    """
    return write_rendered(model, path, render_representable(model, render_urdf))


def render_urdf(model: RobotModel) -> RenderedModel:
    """The URDF of `model` with its geometric errors in the joint origins, its inertials, and a link a point of `points:` there.

    The point links are named after the points. Offsets, misalignments and lengths (Eqs. 15-17) fit a URDF exactly. A link identified with
    inertials that no body has keeps those of the nominal URDF. Raises `FlexcalError` where a point's name is already a link's.
    """
    with open_regular(model.urdf, limit=LARGEST_URDF) as stream:
        tree = ET.parse(stream, ET.XMLParser(target=ET.TreeBuilder(insert_comments=True)))
    root = tree.getroot()
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    for i, joint in enumerate(model.joints):
        position, rotation = link_placement(model, i)
        if (position != joint.translation).any() or (rotation != joint.rotation).any():
            shift = joint.rotation.T @ (position - joint.translation)
            _move(joints[joint.name], shift, joint.rotation.T @ rotation)
    _write_mimics(model, joints)
    bodiless = write_inertials(model, root)
    _add_points(model, root)
    ET.indent(tree)
    text = '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode", xml_declaration=False) + "\n"
    return RenderedModel(text, urdf_tool(model, text), AT_REST, "<!--", remarks=_remarks(model, bodiless))


def urdf_tool(model: RobotModel, text: str) -> ToolMap:
    """Position of the first point of `model` in Pinocchio, from the URDF `text`."""
    return lambda q: link_placements(model, text, model.point().name, q)[0]


def link_placements(model: RobotModel, text: str, link: str, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (N, 3), m, and rotations (N, 3, 3) of a link at the motors' `q` (N, n) in Pinocchio, from the URDF `text`."""
    import pinocchio as pin

    from flexcal.model.urdf import locked_joints, pinocchio_model_of

    read = pinocchio_model_of(text)
    read = pin.buildReducedModel(read, *locked_joints(read, model.config.locked))
    data, frame = read.createData(), read.getFrameId(link, pin.FrameType.BODY)
    joints = [read.joints[read.getJointId(name)] for name in model.joint_names]
    positions, rotations = np.zeros((len(q), 3)), np.zeros((len(q), 3, 3))
    for k, own in enumerate(joint_values(model, q)):
        configuration = pin.neutral(read)
        for joint, value in zip(joints, own, strict=True):
            turn = (value,) if joint.nq == 1 else (np.cos(value), np.sin(value))
            configuration[joint.idx_q : joint.idx_q + joint.nq] = turn
        pin.framesForwardKinematics(read, data, configuration)
        positions[k], rotations[k] = data.oMf[frame].translation, data.oMf[frame].rotation
    return positions, rotations


def _remarks(model: RobotModel, bodiless: tuple[str, ...]) -> tuple[str, ...]:
    """Remarks on parts of the dynamics that the file lacks, one sentence each."""
    sentences = [*bodiless_remark(bodiless), *relation_remarks(model, "URDF")]
    if any(f"{name}.rotor_inertia" in model.posterior.parameters for name in model.joint_names):
        sentences.append(
            "Rotor inertia, friction and torque offset of the drives stay in estimates.yaml: torques need them besides."
        )
    return tuple(sentences)


def _write_mimics(model: RobotModel, joints: Mapping[str | None, ET.Element]) -> None:
    """Set the <mimic> of every joint that follows others to what it follows alone, and remove that of one that follows several."""
    held, names = mimicked(model), model.joint_names
    for i in followed_joints(model):
        element = joints[names[i]]
        for mimic in element.findall("mimic"):
            element.remove(mimic)
        if i in held:
            other, ratio, offset = held[i]
            ET.SubElement(element, "mimic", joint=names[other], multiplier=repr(ratio), offset=repr(offset))


def _move(joint: ET.Element, shift: np.ndarray, turn: np.ndarray) -> None:
    """Append Trans(shift) · turn to a joint's origin."""
    origin = joint.find("origin")
    if origin is None:
        origin = ET.SubElement(joint, "origin")
    xyz = np.array([float(v) for v in origin.get("xyz", "0 0 0").split()])
    rotation = rpy_rotation(np.array([float(v) for v in origin.get("rpy", "0 0 0").split()]))
    _place(origin, xyz + rotation @ shift, rotation @ turn)


def _place(origin: ET.Element, xyz: np.ndarray, rotation: np.ndarray) -> None:
    origin.set("xyz", " ".join(repr(float(v)) for v in xyz))
    origin.set("rpy", " ".join(repr(float(v)) for v in rotation_rpy(rotation)))


def _add_points(model: RobotModel, root: ET.Element) -> None:
    links = {link.get("name") for link in root.findall("link")}
    for name in model.points:
        if name in links:
            raise FlexcalError(
                "E-EXPORT-006",
                f"the point '{name}' has the name of a link of {model.urdf.name}; rename it under `points:`.",
            )
        carrier, position, rotation = point_placement(model, name)
        ET.SubElement(root, "link", name=name)
        joint = ET.SubElement(root, "joint", name=f"{name}_point", type="fixed")
        _place(ET.SubElement(joint, "origin"), position, rotation)
        ET.SubElement(joint, "parent", link=model.joints[carrier].link)
        ET.SubElement(joint, "child", link=name)
