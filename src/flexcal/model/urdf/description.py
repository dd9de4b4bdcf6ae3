"""Conversion of a URDF to joints, inertias and frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal.errors import InputError
from flexcal.files.transaction import current_path
from flexcal.model.parts import Inertia, Joint, axis_rotation, normals_to, rpy_rotation, skew_matrix
from flexcal.model.urdf.checks import carried_links, mimicry
from flexcal.model.urdf.elements import Element, read_elements

_MOMENTS = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
_NO_MASS = 1e-16


@dataclass(frozen=True, eq=False)
class Frame:
    """A URDF link or joint frame at `rotation` (3, 3), `translation` (3,) in the link of joint `joint` (-1: the base)."""

    joint: int
    rotation: np.ndarray
    translation: np.ndarray

    def beyond(self, rotation: np.ndarray, translation: np.ndarray) -> Frame:
        """Frame at `rotation` (3, 3) and `translation` (3,) in this one."""
        return Frame(self.joint, self.rotation @ rotation, self.translation + self.rotation @ translation)


@dataclass(frozen=True, eq=False)
class Description:
    """Content of a URDF: movable joints, the inertia of each (with fixed and locked children), and all frames.

    Joints stand depth first, branches in the order of the file. `mimics`: for each joint that mimics another, its name, the multiplier and
    the offset.
    """

    name: str
    joints: tuple[Joint, ...]
    inertias: tuple[Inertia, ...]
    frames: dict[str, Frame]
    mimics: dict[str, tuple[str, float, float]]


def read_urdf(path: Path, locked: Mapping[str, float]) -> Description:
    """Read a URDF of revolute, continuous, prismatic and fixed joints; those `locked` at a position (rad or m) count as fixed.

    Raises `InputError`, with line and link or joint, where the file is missing, incomplete or unreadable, where it has no movable joint,
    for other joint types, and where a joint cannot be locked.
    """
    if not current_path(path).is_file():
        raise InputError("E-URDF-021", f"{path}: there is no such URDF file; correct `robot:` in robot.yaml.")
    robot = read_elements(path)
    carried = carried_links(robot, locked)
    name = robot.attributes.get("name")
    if not name:
        raise robot.error("E-URDF-022", "the robot has no name; add the attribute 'name'.")
    links = {link.attributes["name"]: link for link in robot.all("link")}
    elements = {joint.attributes["name"]: joint for joint in robot.all("joint")}
    _check_names(carried, links, elements)
    _check_locked(path, elements, locked)
    root = next(link for link in links if link not in carried.values())
    frames = {root: Frame(-1, np.eye(3), np.zeros(3))}
    joints: list[Joint] = []
    inertias: list[Inertia] = []
    for joint, link in carried.items():
        element = elements[joint]
        frame = frames[_parent(element)].beyond(*_origin(element, joint))
        if element.attributes["type"] == "fixed":
            pass
        elif joint in locked:
            frame = frame.beyond(*_displacement(element, joint, locked[joint]))
        else:
            joints.append(_joint(element, joint, link, frame))
            inertias.append(Inertia(0.0, np.zeros(3), np.zeros((3, 3))))
            frame = Frame(len(joints) - 1, np.eye(3), np.zeros(3))
        frames[joint] = frames[link] = frame
        inertial = links[link].find("inertial")
        if inertial is not None and frame.joint >= 0:
            inertias[frame.joint] = _together(inertias[frame.joint], _inertia(inertial, link), frame)
    if not joints:
        raise InputError("E-URDF-024", f"{path}: the URDF has no movable joint; a robot needs at least one.")
    return Description(name, tuple(joints), tuple(inertias), frames, mimicry(robot, locked))


def _parent(joint: Element) -> str:
    """Name of the link that carries a joint, which `carried_links` has checked."""
    parent = joint.find("parent")
    assert parent is not None
    return parent.attributes["link"]


def _check_names(
    carried: Mapping[str, str], links: Mapping[str, Element], elements: Mapping[str, Element]
) -> None:
    """Refuse joints called as a link, but for one that carries this link and nothing else, as with `tool0`: both frames are one."""
    parents = {_parent(joint) for joint in elements.values()}
    for joint, link in carried.items():
        if joint in links and (joint != link or link in parents):
            raise elements[joint].error("E-URDF-023", f"a joint and a link are called '{joint}'; rename one.")


def _check_locked(path: Path, elements: Mapping[str, Element], locked: Mapping[str, float]) -> None:
    movable = [name for name, joint in elements.items() if joint.attributes["type"] != "fixed"]
    for name, position in locked.items():
        if name not in movable:
            raise InputError(
                "E-URDF-025",
                f"{path}: there is no movable joint '{name}' to lock; there are {', '.join(movable)}; "
                "correct `locked:` in robot.yaml.",
            )
        lower, upper = _limits(elements[name], name)[:2]
        if not lower <= position <= upper:
            raise InputError(
                "E-URDF-026",
                f"{path}: '{name}' is locked at {position:g}, but its limits are {lower:g} and {upper:g}; "
                "correct `locked:` in robot.yaml.",
            )


def _joint(element: Element, name: str, link: str, frame: Frame) -> Joint:
    """Movable joint at a `frame` in the link of the joint before it."""
    axis = _axis(element, name)
    lower, upper, velocity, effort = _limits(element, name)
    kind = "prismatic" if element.attributes["type"] == "prismatic" else "revolute"
    return Joint(
        name=name,
        link=link,
        parent=frame.joint,
        kind=kind,
        rotation=frame.rotation,
        translation=frame.translation,
        axis=axis,
        normals=normals_to(axis),
        lower=lower,
        upper=upper,
        velocity=velocity,
        effort=effort,
    )


def _origin(element: Element, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and translation (3,) of the element's <origin>."""
    origin, values = element.find("origin"), {"rpy": np.zeros(3), "xyz": np.zeros(3)}
    if origin is not None:
        values |= {key: origin.numbers(key, 3, f"'{name}'") for key in values if key in origin.attributes}
    return rpy_rotation(values["rpy"]), values["xyz"]


def _axis(element: Element, name: str) -> np.ndarray:
    axis = element.find("axis")
    direction = np.array([1.0, 0.0, 0.0]) if axis is None else axis.numbers("xyz", 3, f"joint '{name}'")
    return direction / np.linalg.norm(direction)


def _displacement(element: Element, name: str, position: float) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and translation (3,) of a joint at a position, rad or m."""
    axis = _axis(element, name)
    if element.attributes["type"] == "prismatic":
        return np.eye(3), position * axis
    return axis_rotation(axis, position), np.zeros(3)


def _limits(element: Element, name: str) -> tuple[float, float, float, float]:
    """Lower and upper position, velocity and effort of a movable joint; infinite where the URDF has none."""
    limit = element.find("limit")
    if limit is None:
        return -np.inf, np.inf, np.inf, np.inf
    keys = ("lower", "upper", "velocity", "effort")
    lower, upper, velocity, effort = (
        float(limit.numbers(key, 1, f"joint '{name}'")[0]) if key in limit.attributes else 0.0 for key in keys
    )
    if element.attributes["type"] == "continuous":
        lower, upper = -np.inf, np.inf
    return lower, upper, velocity, effort


def _inertia(inertial: Element, link: str) -> Inertia:
    """Inertia in the link's axes; complete, as `carried_links` has checked."""
    owner = f"link '{link}'"
    mass, moments = inertial.find("mass"), inertial.find("inertia")
    assert mass is not None and moments is not None
    rotation, com = _origin(inertial, link)
    inertia = np.array([[moments.numbers(key, 1, owner)[0] for key in row] for row in _MOMENTS])
    return Inertia(float(mass.numbers("value", 1, owner)[0]), com, rotation @ inertia @ rotation.T)


def _together(carrying: Inertia, link: Inertia, frame: Frame) -> Inertia:
    """Inertia of a body and of a link that is fixed to it at a `frame`, about their common centre of mass."""
    com = frame.translation + frame.rotation @ link.com
    mass = carrying.mass + link.mass
    share = 1.0 / max(mass, _NO_MASS)
    apart = skew_matrix(carrying.com - com)
    return Inertia(
        mass,
        (carrying.mass * carrying.com + link.mass * com) * share,
        carrying.inertia
        + frame.rotation @ link.inertia @ frame.rotation.T
        - carrying.mass * link.mass * share * (apart @ apart),
    )
