"""Identified inertials in the elements of an expanded description."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexcal.export.urdf_inertials import MOMENTS, bodiless_links, is_same
from flexcal.export.wanted_numbers import Wanted
from flexcal.export.xacro_expansion import ExpandedElement, Expansion
from flexcal.model.parts import Inertia, parallel_axis, pseudo_inertia, rpy_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import read_urdf

_NONE = (0.0, 0.0, 0.0)


def wanted_inertials(model: RobotModel, expansion: Expansion) -> tuple[list[Wanted], tuple[str, ...]]:
    """Numbers of the links whose inertia differs from the URDF's, and the links that keep theirs although they differ.

    What hangs on a link by fixed or locked joints keeps its own inertials; the link has the rest.
    """
    nominal = read_urdf(model.urdf, model.config.locked).inertias
    left = bodiless_links(model, nominal)
    links = {e.attributes.get("name", ""): e for e in expansion.root.children if e.tag == "link"}
    wanted: list[Wanted] = []
    kept: list[str] = []
    for joint, ours, theirs in zip(model.joints, model.inertias, nominal, strict=True):
        if is_same(ours, theirs) or joint.link in left:
            continue
        link = links[joint.link]
        inertial = link.find("inertial")
        rest = None if inertial is None else _rest(ours, theirs, inertial)
        if inertial is None or rest is None or not _is_own(expansion, inertial):
            kept.append(joint.link)
        else:
            wanted += _numbers(link, inertial, rest)
    return wanted, tuple(kept)


def _is_own(expansion: Expansion, inertial: ExpandedElement) -> bool:
    """Whether the sources have this element for the link alone, or for the copies of one link."""
    if inertial.place is None or any(child.place is None for child in inertial.children):
        return False
    if sum(other.place == inertial.place for other in expansion.root.walk()) == 1:
        return True
    path, number = inertial.place
    around = expansion.sources[path].elements[number].parent
    while around is not None and around.tag != "link":
        around = around.parent
    return around is not None


def _rest(ours: Inertia, theirs: Inertia, inertial: ExpandedElement) -> Inertia | None:
    """What the link itself has of its identified inertia, the others on it being as in the URDF; None where no body has that."""
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    if mass is None or inertia is None:
        return None
    tensor = np.zeros((3, 3))
    for key, (row, column) in MOMENTS.items():
        tensor[row, column] = tensor[column, row] = float(inertia.attributes.get(key, "0"))
    xyz, rpy = _placed(inertial)
    turn = rpy_rotation(rpy)
    own = Inertia(float(mass.attributes["value"]), xyz, turn @ tensor @ turn.T)
    total = own.mass + ours.mass - theirs.mass
    first = own.mass * own.com + ours.mass * ours.com - theirs.mass * theirs.com
    if total <= 0:
        return None
    com = first / total
    rest = Inertia(
        total, com, _at_origin(own) + _at_origin(ours) - _at_origin(theirs) - parallel_axis(total, com)
    )
    return rest if np.linalg.eigvalsh(pseudo_inertia(rest))[0] > 0 else None


def _numbers(link: ExpandedElement, inertial: ExpandedElement, rest: Inertia) -> Iterator[Wanted]:
    """Numbers of an inertia; its axes stay turned as they are."""
    _, rpy = _placed(inertial)
    turn = rpy_rotation(rpy)
    tensor = turn.T @ rest.inertia @ turn
    origin, mass, inertia = (inertial.find(tag) for tag in ("origin", "mass", "inertia"))
    yield Wanted(link, "com", inertial, origin, "origin", "xyz", tuple(rest.com.tolist()), _NONE)
    yield Wanted(link, "mass", inertial, mass, "mass", "value", (rest.mass,), (0.0,))
    for key, (row, column) in MOMENTS.items():
        yield Wanted(link, key, inertial, inertia, "inertia", key, (float(tensor[row, column]),), (0.0,))


def _placed(inertial: ExpandedElement) -> tuple[np.ndarray, np.ndarray]:
    origin = inertial.find("origin")
    texts = [None if origin is None else origin.attributes.get(key) for key in ("xyz", "rpy")]
    xyz, rpy = (np.array([float(word) for word in (text or "0 0 0").split()]) for text in texts)
    return xyz, rpy


def _at_origin(body: Inertia) -> np.ndarray:
    return body.inertia + parallel_axis(body.mass, body.com)
