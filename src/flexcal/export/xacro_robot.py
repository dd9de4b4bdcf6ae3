"""A calibrated robot in the xacro files or the URDF that it was described by: only the numbers change that the calibration changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from flexcal.errors import FlexcalError, InputError
from flexcal.export.following_joints import mimicked, relation_remarks
from flexcal.export.representation_error import ToolMap
from flexcal.export.urdf import link_placements
from flexcal.export.urdf_inertials import bodiless_links, bodiless_remark
from flexcal.export.wanted_numbers import Wanted
from flexcal.export.xacro_expansion import ExpandedElement, Expansion, XacroSource
from flexcal.export.xacro_inertials import wanted_inertials
from flexcal.export.xacro_patch import PatchedDescription, patched_description
from flexcal.export.xacro_zeros import wanted_zeros
from flexcal.model.kinematics import joint_placement, link_placement, point_placement
from flexcal.model.parts import rotation_rpy, rpy_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import carried_links, read_elements, read_urdf

Zeros = Literal["origins", "ros2_control"]
_SAME = 1e-6
"""Difference of the numbers of a joint, m and rad, from which the files describe another robot than the URDF."""
_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class XacroExport:
    """Content of the files, by their paths, what each of the changed ones got, and where the `tool` of the expanded robot is.

    `points` has position, m, and roll, pitch, yaw, rad, of the points of robot.yaml in their links; no file has them.
    """

    description: PatchedDescription
    tool: ToolMap
    remarks: tuple[str, ...]
    points: Mapping[str, tuple[str, tuple[float, ...], tuple[float, ...]]]


def render_xacro(model: RobotModel, nominal: RobotModel, source: XacroSource, zeros: Zeros) -> XacroExport:
    """The files of `source` with the placements of joints and the inertials of `model`, whose geometry is that to write.

    With the `zeros` in ros2_control the offsets of the joints stand there and nowhere else, and limits move with them. Raises
    `InputError` as `XacroSource.expand` does, and where the files describe another robot than the URDF of `nominal`; `FlexcalError` where
    numbers cannot be replaced, and for joints that follow others otherwise than the files say.
    """
    expansion = source.expand({})
    _require_same_robot(source, expansion, nominal)
    if mimicked(model) != mimicked(nominal):
        raise FlexcalError(
            "E-ROS-011",
            f"the calibration changed how joints of {model.name} follow others, which {source.path} cannot be given; export urdf instead.",
        )
    joints = _joints(expansion)
    wanted = list(_wanted_origins(model, joints, zeros))
    if zeros == "ros2_control":
        wanted += wanted_zeros(source.path, expansion, joints, model)
    inertials, kept = wanted_inertials(model, expansion)
    description = patched_description(source, expansion, [*wanted, *inertials])
    left = bodiless_links(model, read_urdf(model.urdf, model.config.locked).inertias)
    remarks = [*bodiless_remark(left), *relation_remarks(model, "URDF")]
    if kept:
        remarks.append(
            f"The inertials of {', '.join(kept)} stay as they were: they are not written in the link itself, or what hangs on it weighs "
            "more than was identified; 'export urdf' has them."
        )
    tool = _tool_map(source, model, description.expansion.text, zeros)
    return XacroExport(description, tool, tuple(remarks), _points(model))


def _joints(expansion: Expansion) -> dict[str, ExpandedElement]:
    return {
        child.attributes.get("name", ""): child for child in expansion.root.children if child.tag == "joint"
    }


def _wanted_origins(
    model: RobotModel, joints: Mapping[str, ExpandedElement], zeros: Zeros
) -> Iterator[Wanted]:
    for i, joint in enumerate(model.joints):
        position, rotation = (link_placement if zeros == "origins" else joint_placement)(model, i)
        if (position == joint.translation).all() and (rotation == joint.rotation).all():
            continue
        element = joints[joint.name]
        origin = element.find("origin")
        xyz, rpy = (_numbers(origin, key) for key in ("xyz", "rpy"))
        turned = rpy_rotation(rpy)
        moved = xyz + turned @ joint.rotation.T @ (position - joint.translation)
        turned = turned @ joint.rotation.T @ rotation
        angles = _nearest_rpy(rotation_rpy(turned), rpy)
        for key, values in (("xyz", moved), ("rpy", angles)):
            yield Wanted(element, key, element, origin, "origin", key, tuple(values.tolist()), _NONE)


def _nearest_rpy(rpy: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw of the same rotation that are nearest to those of before."""
    roll, pitch, yaw = rpy
    other = np.array([roll + np.pi, np.pi - pitch, yaw + np.pi])
    turns = [angles + 2 * np.pi * np.round((before - angles) / (2 * np.pi)) for angles in (rpy, other)]
    return min(turns, key=lambda angles: float(np.abs(angles - before).sum()))


def _require_same_robot(source: XacroSource, expansion: Expansion, nominal: RobotModel) -> None:
    """Raise `InputError` where the description makes no complete URDF, where a joint of that of the robot is missing, or is another."""
    carried_links(expansion.located(expansion.root), nominal.config.locked)
    joints = _joints(expansion)
    for element in read_elements(nominal.urdf).all("joint"):
        name = element.attributes["name"]
        own = joints.get(name)
        if own is None:
            raise InputError(
                "E-ROS-012",
                f"{source.path}: there is no joint '{name}', which {nominal.urdf.name} has; give the file that the URDF was made of, "
                "and its --arguments.",
            )
        if own.attributes.get("type") != element.attributes["type"]:
            raise InputError(
                "E-ROS-041",
                f"{source.path}: joint '{name}' is {own.attributes.get('type')}, but {element.attributes['type']} in {nominal.urdf.name}, "
                "with which the robot was calibrated; give the file that this was made of, and its --arguments.",
            )
        ends = [(tag, "link", None) for tag in ("parent", "child")]
        numbers = [("origin", "xyz", _NONE), ("origin", "rpy", _NONE), ("axis", "xyz", (1.0, 0.0, 0.0))]
        for tag, key, usual in (*ends, *numbers):
            theirs, ours = element.find(tag), own.find(tag)
            texts = [None if e is None else e.attributes.get(key) for e in (theirs, ours)]
            if usual is None:
                same = texts[0] == texts[1]
            else:
                values = [np.array([float(w) for w in text.split()] if text else usual) for text in texts]
                same = values[0].shape == values[1].shape and bool(
                    (np.abs(values[0] - values[1]) <= _SAME).all()
                )
            if not same and (tag != "axis" or element.attributes.get("type") != "fixed"):
                raise InputError(
                    "E-ROS-013",
                    f"{source.path}: <{tag} {key}> of joint '{name}' is {texts[1] or 'absent'}, but {texts[0] or 'absent'} in "
                    f"{nominal.urdf.name}, with which the robot was calibrated; give the file that this was made of, and its --arguments.",
                )


def _tool_map(source: XacroSource, model: RobotModel, text: str, zeros: Zeros) -> ToolMap:
    """Position of the first point by the expanded description, in which no point has a link."""
    shift = model.joint_offsets if zeros == "ros2_control" else 0.0

    def positions(q: np.ndarray) -> np.ndarray:
        carrier, point, _ = point_placement(model, model.point().name)
        try:
            position, rotation = link_placements(model, text, model.joints[carrier].link, q + shift)
        except (ValueError, RuntimeError) as problem:
            raise InputError(
                "E-ROS-042",
                f"{source.path}: Pinocchio cannot load what it makes; correct its <visual>, <collision>, <mimic> or <safety_controller>.",
            ) from problem
        return position + rotation @ point

    return positions


def _points(model: RobotModel) -> dict[str, tuple[str, tuple[float, ...], tuple[float, ...]]]:
    result = {}
    for name in model.points:
        carrier, position, rotation = point_placement(model, name)
        angles = rotation_rpy(rotation)
        result[name] = (model.joints[carrier].link, tuple(position.tolist()), tuple(angles.tolist()))
    return result


def _numbers(element: ExpandedElement | None, attribute: str) -> np.ndarray:
    text = "" if element is None else element.attributes.get(attribute, "")
    return np.array([float(word) for word in text.split()]) if text else np.zeros(3)
