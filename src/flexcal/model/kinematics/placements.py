"""Placements of joints and points in their links, geometric errors included.

One joint, parent to child (Eqs. 15-17; docs: the full chain of one axis): length error of the parent, nominal placement,
misalignment_2, misalignment_1, the joint's motion with its offset; bearing tilts follow, or come before the motion where robot.yaml
says `bearings: before`. The kernels hold the same chain for speed.
"""

from __future__ import annotations

import numpy as np

from flexcal.model.parts import ElasticJoint, axis_rotation
from flexcal.model.robot import RobotModel


def joint_placement(model: RobotModel, joint: int) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) m and rotation (3, 3) of a joint in its parent link, before its motion and offset."""
    nominal, (_, first, second) = model.joints[joint], model.geometry.errors[joint, :3]
    length = np.zeros(3) if nominal.parent < 0 else model.geometry.errors[nominal.parent, 3:]
    turn = axis_rotation(nominal.normals[1], second) @ axis_rotation(nominal.normals[0], first)
    return nominal.translation + model.geometry.origin_error[joint] + length, nominal.rotation @ turn


def link_placement(model: RobotModel, joint: int, q: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) m and rotation (3, 3) of a joint's link in the parent link with the motor at `q` (rad or m), undeflected."""
    position, rotation = joint_placement(model, joint)
    axis, motion = model.joints[joint].axis, q + model.joint_offsets[joint]
    if model.joints[joint].kind == "prismatic":
        return position + rotation @ axis * motion, rotation
    return position, rotation @ axis_rotation(axis, motion)


def bearing_placement(model: RobotModel, spring: ElasticJoint, q: float = 0.0) -> np.ndarray:
    """Axes (3, 3) about which the bearing tilts, and the joint's, in the axes of its link at `link_placement`."""
    if not spring.tilts_first:
        return spring.frame
    motion = q + model.joint_offsets[spring.index]
    return axis_rotation(model.joints[spring.index].axis, -motion) @ spring.frame


def point_placement(model: RobotModel, name: str) -> tuple[int, np.ndarray, np.ndarray]:
    """Joint whose link carries a target, its position (3,) m and frame (3, 3) in that link, with the errors of link and tool."""
    point = model.point(name)
    tool, own = model.geometry.tool, model.geometry.point_error[list(model.points).index(name)]
    x, y, z = np.eye(3)
    turn = axis_rotation(y, tool[2]) @ axis_rotation(x, tool[1]) @ axis_rotation(z, tool[0])
    rotation = point.rotation @ turn
    length = tool[3:] if name == model.tool_point else np.zeros(3)
    position = (
        point.translation + model.geometry.errors[point.joint, 3:] + rotation @ (point.xyz + own + length)
    )
    return point.joint, position, rotation


def found_xyz(model: RobotModel, name: str) -> np.ndarray:
    """Position (3,) m of a target in the frame in which robot.yaml declares it, with the errors of link and tool."""
    point = model.point(name)
    _, position, _ = point_placement(model, name)
    return point.rotation.T @ (position - point.translation)
