"""Identified inertials in a URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Container, Iterator, Sequence

import numpy as np

from flexcal.model.parts import Inertia, is_physically_consistent
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import read_urdf

MOMENTS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
"""Rows and columns of the attributes of <inertia>."""


def write_inertials(model: RobotModel, root: ET.Element) -> tuple[str, ...]:
    """Set the inertia of every link of the URDF `root` to that of `model`; nonphysical links keep theirs, and are returned.

    Only what differs from the URDF is touched. What hangs on a link by fixed or locked joints is part of it: its own inertials go.
    """
    nominal = read_urdf(model.urdf, model.config.locked).inertias
    left = bodiless_links(model, nominal)
    for joint, ours, theirs in zip(model.joints, model.inertias, nominal, strict=True):
        if is_same(ours, theirs) or joint.link in left:
            continue
        carrier, *others = _rigid_body(root, joint.link, model.config.locked)
        for link in (carrier, *others):
            for inertial in link.findall("inertial"):
                link.remove(inertial)
        _add_inertial(carrier, ours)
    return left


def bodiless_links(model: RobotModel, nominal: Sequence[Inertia]) -> tuple[str, ...]:
    """Links with identified nonphysical inertials, beside their `nominal` ones."""
    return tuple(
        joint.link
        for joint, ours, theirs in zip(model.joints, model.inertias, nominal, strict=True)
        if not is_same(ours, theirs) and not is_physically_consistent(model.values, joint.link)
    )


def bodiless_remark(links: tuple[str, ...]) -> tuple[str, ...]:
    """Remark on links whose identified inertials are not written, if any."""
    if not links:
        return ()
    return (
        f"No body can have the inertials identified for {', '.join(links)}, which stay nominal; identify dynamics with --estimator sdp.",
    )


def is_same(one: Inertia, other: Inertia) -> bool:
    """Whether two inertias have the same numbers."""
    return (
        one.mass == other.mass
        and np.array_equal(one.com, other.com)
        and np.array_equal(one.inertia, other.inertia)
    )


def _rigid_body(root: ET.Element, name: str, locked: Container[str]) -> Iterator[ET.Element]:
    """Link with those attached by fixed and locked joints."""
    links = {link.get("name"): link for link in root.findall("link")}
    hung: dict[str | None, list[str]] = {}
    for joint in root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        rigid = joint.get("type") == "fixed" or joint.get("name", "") in locked
        if rigid and parent is not None and child is not None:
            hung.setdefault(parent.get("link"), []).append(child.get("link", ""))
    waiting = [name]
    while waiting:
        at = waiting.pop()
        yield links[at]
        waiting += hung.get(at, [])[::-1]


def _add_inertial(link: ET.Element, inertia: Inertia) -> None:
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=" ".join(repr(float(v)) for v in inertia.com), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=repr(float(inertia.mass)))
    moments = {key: repr(float(inertia.inertia[place])) for key, place in MOMENTS.items()}
    ET.SubElement(inertial, "inertia", moments)
