"""Identified inertials in a URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Container, Iterator

import numpy as np

from flexcal.model import Inertia, RobotModel
from flexcal.model.pseudo_inertia import is_body
from flexcal.model.urdf import read_urdf

_MOMENTS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def write_inertials(model: RobotModel, root: ET.Element) -> tuple[str, ...]:
    """Give every link of the URDF `root` the inertia that `model` has; links that no body can be keep theirs, and are returned.

    Only what differs from the URDF is touched. What hangs on a link by fixed or locked joints is part of it: its own inertials go.
    """
    left: list[str] = []
    nominal = read_urdf(model.urdf, model.config.locked).inertias
    for joint, ours, theirs in zip(model.joints, model.inertias, nominal, strict=True):
        if _same(ours, theirs):
            continue
        if not is_body(model.values, joint.link):
            left.append(joint.link)
            continue
        carrier, *others = _rigid_body(root, joint.link, model.config.locked)
        for link in (carrier, *others):
            for inertial in link.findall("inertial"):
                link.remove(inertial)
        _add_inertial(carrier, ours)
    return tuple(left)


def _same(one: Inertia, other: Inertia) -> bool:
    return (
        one.mass == other.mass
        and np.array_equal(one.com, other.com)
        and np.array_equal(one.inertia, other.inertia)
    )


def _rigid_body(root: ET.Element, name: str, locked: Container[str]) -> Iterator[ET.Element]:
    """A link, and those that fixed and locked joints hang on it."""
    yield next(link for link in root.findall("link") if link.get("name") == name)
    for joint in root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        rigid = joint.get("type") == "fixed" or joint.get("name", "") in locked
        if rigid and parent is not None and parent.get("link") == name:
            yield from _rigid_body(root, "" if child is None else child.get("link", ""), locked)


def _add_inertial(link: ET.Element, inertia: Inertia) -> None:
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=" ".join(repr(float(v)) for v in inertia.com), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=repr(float(inertia.mass)))
    moments = {key: repr(float(inertia.inertia[place])) for key, place in _MOMENTS.items()}
    ET.SubElement(inertial, "inertia", moments)
