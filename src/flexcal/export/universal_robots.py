"""The `kinematics` YAML of Universal Robots' ROS description: placement of each joint in the previous link.

The description's link frames are those of Denavit and Hartenberg, its first link is the base turned by 180° about z, and the last
frame is the tool flange. So a row here is Rx(alpha) Tx(a) Ry(beta) Rz(theta) Tz(d) of the modified convention as one placement.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.export.chain import chain_to
from flexcal.export.dh_parameters import Axes, DhChain, chain_axes, dh_chain, joint_transform, link_transform
from flexcal.export.representation_error import AT_REST, ToolMap
from flexcal.export.transforms import Z, from_xyz_rpy, transform, turned, xyz_rpy
from flexcal.export.written_file import RenderedModel
from flexcal.model.parts import rotation_vector
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import read_elements, read_urdf

LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
_TURNED_BASE = "base_link_inertia"
_FLANGE = "tool0"
_ALPHA = np.pi / 2 * np.array([1, 0, 0, 1, -1, 0])
_ALIKE = np.deg2rad(1.0)


def render_kinematics(model: RobotModel, nominal: RobotModel) -> RenderedModel:
    """The calibrated joint placements as `kinematics: {shoulder: {x, y, z, roll, pitch, yaw}, …, hash}`.

    The last frame is at the URDF's `tool0` along the last axis, or at the last link without one. Raises `FlexcalError` for a robot that
    is not one chain of six revolute joints, or has no point at its end.
    """
    point, chain = chain_to(model, None, "Placements of joints")
    if chain != (0, 1, 2, 3, 4, 5) or model.n != 6 or {j.kind for j in model.joints} != {"revolute"}:
        raise FlexcalError(
            "E-EXPORT-005",
            f"a kinematics file is of one chain of six revolute joints, which {model.name} is not; export urdf or mdh instead.",
        )
    root = _base_of_description(nominal)
    before = dh_chain(_seen_from(root, chain_axes(nominal, point, chain)), hayati=True)
    after = dh_chain(_seen_from(root, chain_axes(model, point, chain)), hayati=True, like=before)
    back = before.d[-1] - _flange_reach(nominal, root, before)
    placements = [after.base @ joint_transform(after.theta[0], after.d[0])]
    for k in range(1, 6):
        link = link_transform(after.a[k - 1], after.alpha[k - 1], after.beta[k - 1])
        placements.append(link @ joint_transform(after.theta[k], after.d[k] - (back if k == 5 else 0.0)))
    alike = np.abs(before.alpha - _ALPHA).max() < _ALIKE
    text = _yaml(placements)
    tool = joint_transform(0.0, back) @ after.tool
    xyz, vector = tool[:3, 3], rotation_vector(tool[:3, :3])
    return RenderedModel(
        text,
        _tool_map(text, root, tool),
        AT_REST,
        "#",
        about=(
            "Joint placements for Universal Robots' ROS description (kinematics_params), base frame base_link_inertia.",
        ),
        remarks=(
            f"The point '{point}' has no place in this file; in the frame of wrist_3 it is at x, y, z = {_told(xyz)} m, turned by the "
            f"rotation vector {_told(vector)} rad: enter it as the tool.",
            "The hash is flexcal's own: a driver that compares it with the controller's calibration will say that they differ.",
            *(
                ()
                if alike
                else (
                    f"The axes of {model.name} do not lie as those of Universal Robots' arms: the file has only their form.",
                )
            ),
        ),
        table={"tool": {"xyz": xyz.tolist(), "rotation_vector": vector.tolist()}},
    )


def _tool_map(text: str, root: np.ndarray, tool: np.ndarray) -> ToolMap:
    import yaml

    read = yaml.safe_load(text)["kinematics"]
    links = [from_xyz_rpy(read[name]) for name in LINKS]

    def positions(q: np.ndarray) -> np.ndarray:
        at = np.broadcast_to(root, (len(q), 4, 4))
        for link, angle in zip(links, q.T, strict=True):
            at = at @ link @ turned(Z, angle)
        return (at @ tool)[:, :3, 3]

    return positions


def _yaml(placements: list[np.ndarray]) -> str:
    lines = ["kinematics:"]
    for name, placement in zip(LINKS, placements, strict=True):
        lines.append(f"  {name}:")
        lines += [f"    {key}: {value!r}" for key, value in xyz_rpy(placement).items()]
    digest = hashlib.sha256("\n".join(lines).encode()).hexdigest()
    return "\n".join([*lines, f"  hash: flexcal_{digest[:16]}", ""])


def _base_of_description(model: RobotModel) -> np.ndarray:
    """Frame base_link_inertia in the URDF's root, (4, 4): the first joint's parent if it is that, else turned by 180° about z."""
    first = next(
        e for e in read_elements(model.urdf).all("joint") if e.attributes.get("name") == model.joints[0].name
    )
    parent = first.find("parent")
    assert parent is not None
    name = parent.attributes["link"]
    frame = read_urdf(model.urdf, model.config.locked).frames[name]
    placed = transform(frame.translation, frame.rotation)
    return placed if name == _TURNED_BASE else placed @ np.diag([-1.0, -1.0, 1.0, 1.0])


def _seen_from(root: np.ndarray, axes: Axes) -> Axes:
    turn, origin = root[:3, :3], root[:3, 3]
    return replace(
        axes,
        points=(axes.points - origin) @ turn,
        directions=axes.directions @ turn,
        tool=np.linalg.solve(root, axes.tool),
    )


def _flange_reach(nominal: RobotModel, root: np.ndarray, chain: DhChain) -> float:
    """Length d of the last joint, which ends at the flange of the nominal robot."""
    frames = read_urdf(nominal.urdf, nominal.config.locked).frames
    at = np.linalg.inv(root)
    for joint in nominal.joints:
        at = at @ transform(joint.translation, joint.rotation)
    flange = frames.get(_FLANGE)
    if flange is not None and flange.joint == nominal.n - 1:
        at = at @ transform(flange.translation, flange.rotation)
    last = chain.base
    for k in range(5):
        last = last @ joint_transform(chain.theta[k], chain.d[k])
        last = last @ link_transform(chain.a[k], chain.alpha[k], chain.beta[k])
    return float((at[:3, 3] - last[:3, 3]) @ last[:3, 2])


def _told(values: np.ndarray) -> str:
    return ", ".join(f"{value:.6f}" for value in values)
