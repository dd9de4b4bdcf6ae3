"""Zeros of joints as offsets of ros2_control, with limits that stay where they are on the real arm.

The hardware counts from its own zero: position of the joint in ROS = position of the hardware + offset, for measured positions; a command
goes to the hardware less the offset. So ROS itself has the true angle of the joint, and no origin contains the offset.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from flexcal.errors import InputError
from flexcal.export.wanted_numbers import KEPT, Wanted, is_number
from flexcal.export.xacro_expansion import ExpandedElement, Expansion
from flexcal.model.robot import RobotModel

_LIMITS = (
    ("limit", "lower"),
    ("limit", "upper"),
    ("safety_controller", "soft_lower_limit"),
    ("safety_controller", "soft_upper_limit"),
)
OFFSET = "offset"
_TURN = 6.3
"""Largest offset, rad; larger ones are degrees or ticks."""


def wanted_zeros(
    path: Path, expansion: Expansion, joints: Mapping[str, ExpandedElement], model: RobotModel
) -> list[Wanted]:
    """Offsets of the joints in <ros2_control> on top of those there, limits of the joints and of their position commands.

    Raises `FlexcalError` for joints that follow others, and `InputError` where a joint with an offset is in no <ros2_control>, or
    has one there that is no angle.
    """
    model.require_motors("offsets of ros2_control")
    hardware = {
        joint.attributes.get("name", ""): joint
        for system in expansion.root.children
        if system.tag == "ros2_control"
        for joint in system.children
        if joint.tag == "joint"
    }
    wanted: list[Wanted] = []
    kinds = {joint.name: joint.kind for joint in model.joints}
    for name, offset in zip(model.joint_names, model.joint_offsets.tolist(), strict=True):
        if abs(offset) <= KEPT:
            continue
        if name not in hardware:
            raise InputError(
                "E-ROS-014",
                f"{path}: no <ros2_control> has the joint '{name}', so its offset has no place; add it there, or leave --zeros out.",
            )
        given = _param(hardware[name], OFFSET)
        if given is not None and not _is_position(given.text, kinds[name]):
            raise InputError(
                "E-ROS-017",
                f"{path}: the offset of '{name}' in <ros2_control> is '{given.text[:40]}', not an angle in rad or a length in m, so this "
                "hardware counts otherwise; convert it there, or leave --zeros out.",
            )
        wanted += _of_hardware(joints[name], hardware[name], offset)
        for tag, key in _LIMITS:
            element = joints[name].find(tag)
            if element is not None and key in element.attributes:
                value = (float(expansion.located(element).numbers(key, 1, f"joint '{name}'")[0]) + offset,)
                wanted.append(Wanted(joints[name], key, joints[name], element, tag, key, value, (0.0,)))
    return wanted


def _of_hardware(owner: ExpandedElement, joint: ExpandedElement, offset: float) -> Iterator[Wanted]:
    given = _param(joint, OFFSET)
    before = 0.0 if given is None else float(given.text)
    fixed = (("name", OFFSET),)
    yield Wanted(owner, f"hardware_{OFFSET}", joint, given, "param", None, (before + offset,), (0.0,), fixed)
    for interface in joint.children:
        if interface.tag != "command_interface" or interface.attributes.get("name") != "position":
            continue
        for key in ("min", "max"):
            limit = _param(interface, key)
            if limit is not None and is_number(limit.text):
                value = (float(limit.text) + offset,)
                name = (("name", key),)
                yield Wanted(owner, f"command_{key}", interface, limit, "param", None, value, (0.0,), name)


def _is_position(text: str, kind: str) -> bool:
    return is_number(text) and (kind == "prismatic" or abs(float(text)) <= _TURN)


def _param(element: ExpandedElement, name: str) -> ExpandedElement | None:
    found: Sequence[ExpandedElement] = [
        e for e in element.children if e.tag == "param" and e.attributes.get("name") == name
    ]
    return found[0] if found else None
