"""Checks of a URDF's completeness and numbers beyond those of parsers."""

from __future__ import annotations

from collections.abc import Container, Iterator

import numpy as np

from flexcal.model.urdf.elements import Element

KINDS = ("revolute", "continuous", "prismatic", "fixed")
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
MOST_JOINTS = 100
"""Largest number of movable joints of a robot."""
_ROUNDING = 1e-9
"""Tolerance of the positivity of an inertia, relative to its largest moment."""


def carried_links(robot: Element, locked: Container[str]) -> dict[str, str]:
    """Link carried by each joint of a complete URDF; depth first, branches in the order of the file.

    Raises `InputError` with file, line and link or joint where it is incomplete, unreadable or asks for what flexcal does not have.
    """
    if robot.tag != "robot":
        raise robot.error("E-URDF-001", f"the root element is <{robot.tag}>, not <robot>; give a URDF file.")
    links = _named(robot, "link")
    joints = _named(robot, "joint")
    for name, link in links.items():
        inertial = link.find("inertial")
        if inertial is not None:
            _check_inertial(inertial, f"link '{name}'")
    carried: dict[str, str] = {}
    parents: dict[str, str] = {}
    for name, joint in joints.items():
        parent, child = _check_joint(joint, name, links)
        if child in parents:
            other = next(joint for joint, link in carried.items() if link == child)
            raise joint.error(
                "E-URDF-004",
                f"joint '{name}' carries the link '{child}', which joint '{other}' carries already; open the loop.",
            )
        carried[name], parents[child] = child, parent
    roots = [name for name in links if name not in parents]
    if len(roots) != 1:
        what = (
            f"the links {', '.join(roots)} are not attached to a joint"
            if roots
            else "every link hangs on a joint"
        )
        raise robot.error(
            "E-URDF-005", f"{what}, but a robot has one base; correct the joints' parents and children."
        )
    for name, link in links.items():
        steps, at = 0, name
        while at in parents and steps <= len(links):
            steps, at = steps + 1, parents[at]
        if at in parents:
            raise link.error(
                "E-URDF-006",
                f"the link '{name}' is carried by itself; correct the joints' parents and children.",
            )
    moving = [
        name for name in carried if joints[name].attributes.get("type") != "fixed" and name not in locked
    ]
    if len(moving) > MOST_JOINTS:
        raise joints[moving[MOST_JOINTS]].error(
            "E-URDF-007",
            f"the robot has {len(moving)} movable joints, but flexcal handles at most {MOST_JOINTS}; say where the others stand under "
            "`locked:` in robot.yaml.",
        )
    return {joint: carried[joint] for joint in _beyond(roots[0], carried, parents)}


def mimicry(robot: Element, locked: Container[str]) -> dict[str, tuple[str, float, float]]:
    """Joints that mimic another: its name, the multiplier and the offset; without the `locked` ones.

    Raises `InputError` with file, line and joint where the other one is missing, fixed, locked, or the joint itself.
    """
    joints = _named(robot, "joint")
    moving = [
        name
        for name, joint in joints.items()
        if joint.attributes.get("type") != "fixed" and name not in locked
    ]
    result = {}
    for name in moving:
        mimic = joints[name].find("mimic")
        if mimic is None:
            continue
        other = mimic.attributes.get("joint", "")
        if other not in moving or other == name:
            raise mimic.error(
                "E-URDF-042",
                f"joint '{name}' mimics '{other}', which is no other joint that moves; correct the name, or say where '{name}' stands "
                "under `locked:` in robot.yaml.",
            )
        multiplier, offset = (
            float(mimic.numbers(key, 1, f"joint '{name}'")[0]) if key in mimic.attributes else usual
            for key, usual in (("multiplier", 1.0), ("offset", 0.0))
        )
        if multiplier == 0:
            raise mimic.error(
                "E-URDF-043",
                f"joint '{name}' mimics '{other}' with a multiplier of 0; make it fixed instead.",
            )
        result[name] = (other, multiplier, offset)
    return result


def _beyond(link: str, carried: dict[str, str], parents: dict[str, str]) -> Iterator[str]:
    """Joints beyond a link, each followed by those beyond the link that it carries."""
    of: dict[str, list[str]] = {}
    for joint, child in carried.items():
        of.setdefault(parents[child], []).append(joint)
    waiting = of.get(link, [])[::-1]
    while waiting:
        joint = waiting.pop()
        yield joint
        waiting += of.get(carried[joint], [])[::-1]


def _named(robot: Element, tag: str) -> dict[str, Element]:
    result: dict[str, Element] = {}
    for element in robot.all(tag):
        name = element.attributes.get("name", "")
        if not name:
            raise element.error("E-URDF-008", f"a {tag} has no name; add the attribute 'name'.")
        if name in result:
            raise element.error(
                "E-URDF-009", f"the {tag} '{name}' stands here and on line {result[name].line}; rename one."
            )
        result[name] = element
    if not result and tag == "link":
        raise robot.error("E-URDF-010", "the robot has no link; give a URDF with links and joints.")
    return result


def _check_inertial(inertial: Element, owner: str) -> None:
    _check_origin(inertial, owner)
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    if mass is None or inertia is None:
        raise inertial.error(
            "E-URDF-011", f"<inertial> of {owner} needs both <mass> and <inertia>; add what is missing."
        )
    value = mass.numbers("value", 1, owner)[0]
    if value < 0:
        raise mass.error("E-URDF-012", f"the mass of {owner} is {value:g} kg; it must not be negative.")
    xx, xy, xz, yy, yz, zz = (inertia.numbers(key, 1, owner)[0] for key in _MOMENTS)
    moments = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    least = np.linalg.eigvalsh(moments)[0]
    if least < -_ROUNDING * np.abs(moments).max():
        raise inertia.error(
            "E-URDF-013",
            f"the inertia of {owner} is not positive (its least principal moment is {least:.3g} kg m²); correct its six numbers.",
        )


def _check_joint(joint: Element, name: str, links: dict[str, Element]) -> tuple[str, str]:
    """Check a joint; returns its parent and child link."""
    owner, kind = f"joint '{name}'", joint.attributes.get("type")
    if kind not in KINDS:
        what = f"is of the type '{kind}'" if kind else "has no type"
        raise joint.error(
            "E-URDF-014", f"{owner} {what}, which flexcal does not handle; use {', '.join(KINDS)}."
        )
    ends = []
    for tag in ("parent", "child"):
        end = joint.find(tag)
        link = None if end is None else end.attributes.get("link")
        if end is None or link is None:
            raise joint.error("E-URDF-015", f'{owner} names no {tag} link; add <{tag} link="…"/>.')
        if link not in links:
            raise end.error(
                "E-URDF-016", f"the {tag} of {owner}, '{link}', is no link of this file; correct the name."
            )
        ends.append(link)
    _check_origin(joint, owner)
    if kind == "fixed":
        return ends[0], ends[1]
    axis = joint.find("axis")
    if axis is not None and not np.linalg.norm(axis.numbers("xyz", 3, owner)) > 0:
        raise axis.error("E-URDF-017", f"the axis of {owner} is 0 0 0, which has no direction; correct it.")
    limit = joint.find("limit")
    if kind != "continuous":
        if limit is None:
            raise joint.error(
                "E-URDF-018",
                f'{owner} is {kind} but has no limits; add <limit lower="…" upper="…" effort="…" velocity="…"/>.',
            )
        lower, upper = (limit.numbers(key, 1, owner)[0] for key in ("lower", "upper"))
        if not lower < upper:
            raise limit.error(
                "E-URDF-019", f"the limits of {owner}, {lower:g} to {upper:g}, leave no range; correct them."
            )
    if limit is not None:
        for key in ("effort", "velocity"):
            if limit.numbers(key, 1, owner)[0] < 0:
                raise limit.error("E-URDF-020", f"the {key} limit of {owner} is negative; correct it.")
    return ends[0], ends[1]


def _check_origin(element: Element, owner: str) -> None:
    origin = element.find("origin")
    if origin is not None:
        for key in ("xyz", "rpy"):
            if key in origin.attributes:
                origin.numbers(key, 3, owner)
