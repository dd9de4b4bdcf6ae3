"""Description of an arm from URDF and robot.yaml, independent of `RobotModel`."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from flexcal.errors import FlexcalError
from flexcal.files.formats import read_yaml
from flexcal.files.transaction import MEGABYTE, open_regular
from flexcal.model.robot import RobotConfig
from flexcal.model.urdf import read_elements

TYPICAL_RATIO = 100.0
"""Gear ratio where robot.yaml declares none."""

_LARGEST_URDF = 16 * MEGABYTE


@dataclass(frozen=True, eq=False)
class Link:
    """A body fixed to its parent (`axis` None) or turning about `axis`, at `translation` m and `rotation` (3, 3) of the parent's frame.

    `mass` kg, `com` m and `inertia` (3, 3) kg m² about it, in the link's axes; `parent` indexes the description's links, -1 the base.
    """

    name: str
    joint: str
    parent: int
    translation: np.ndarray
    rotation: np.ndarray
    axis: np.ndarray | None
    mass: float
    com: np.ndarray
    inertia: np.ndarray


@dataclass(frozen=True, eq=False)
class ArmDescription:
    """A serial arm of n revolute joints.

    `springs` and `dampers` (n, 3): about x and y of the bearing and of the drive, N m/rad and N m s/rad, infinite stiffness where rigid;
    `bearing` (n, 3, 3): axes x, y, z of each bearing as columns, in the axes of the link at zero angle. Drive values (n,) at the joint, SI.
    `point` is the reflector: its name, link and place (m); `held_link` and `held_com` those of the payload.
    """

    name: str
    links: tuple[Link, ...]
    springs: np.ndarray
    dampers: np.ndarray
    bearing: np.ndarray
    rotor_inertia: np.ndarray
    viscous: np.ndarray
    coulomb: np.ndarray
    ratio: np.ndarray
    backlash_joints: tuple[int, ...]
    gravity: np.ndarray
    point: tuple[str, int, np.ndarray]
    station: tuple[str, np.ndarray]
    payload: float = 0.0
    payload_std: float = 0.0
    held_link: int = -1
    held_com: np.ndarray | None = None

    @property
    def joints(self) -> tuple[int, ...]:
        """Indices of the links that turn, by joint."""
        return tuple(k for k, link in enumerate(self.links) if link.axis is not None)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(self.links[k].joint for k in self.joints)


def read_description(robot_file: Path) -> ArmDescription:
    """The arm of a robot.yaml as its files declare it.

    Raises `FlexcalError` for a robot that the hard cell cannot be: with sliding or locked joints, with branches, without a point.
    """
    config = read_yaml(robot_file, RobotConfig)
    links = _read_links(robot_file.parent / config.robot)
    turning = [link for link in links if link.axis is not None]
    names, n = [link.joint for link in turning], len(turning)
    if config.locked:
        raise FlexcalError(
            "E-CELL-005",
            f"{robot_file}: the hard cell has no locked joints; run the demonstration with the virtual cell.",
        )
    if not config.points:
        raise FlexcalError("E-CELL-006", f"{robot_file} declares no point to measure; add `points:`.")
    springs, dampers = np.full((n, 3), np.inf), np.zeros((n, 3))
    bearing = np.array([_upright(link.axis) for link in turning])
    for elastic in config.elastic:
        j = names.index(elastic.joint)
        for component, spring in enumerate((elastic.bearing_x, elastic.bearing_y, elastic.drive)):
            if spring is not None:
                springs[j, component], dampers[j, component] = spring.stiffness, spring.damping
        if elastic.frame_rpy is not None:
            bearing[j] = turning[j].rotation.T @ _of_rpy(elastic.frame_rpy)
    index = {link.name: k for k, link in enumerate(links)}
    (point, declared), *_ = config.points.items()
    station, entry = next(iter(config.stations.items()), ("tracker", None))
    place = None if entry is None else entry.in_base
    payload = config.payload

    def drive(values: tuple[float, ...] | None, otherwise: float = 0.0) -> np.ndarray:
        return np.full(n, otherwise) if values is None else np.array(values, dtype=float)

    return ArmDescription(
        name=robot_file.parent.name,
        links=links,
        springs=springs,
        dampers=dampers,
        bearing=bearing,
        rotor_inertia=drive(config.drives.rotor_inertia),
        viscous=drive(config.drives.viscous),
        coulomb=drive(config.drives.coulomb),
        ratio=drive(config.drives.ratio, TYPICAL_RATIO),
        backlash_joints=tuple(names.index(name) for name in config.geometry.backlash),
        gravity=np.array(config.gravity, dtype=float),
        point=(point, index[declared.frame], np.array(declared.xyz, dtype=float)),
        station=(station, np.zeros(3) if place is None else np.array(place, dtype=float)),
        payload=0.0 if payload is None else payload.mass,
        payload_std=0.0 if payload is None else payload.mass_std,
        held_link=-1 if payload is None else index[payload.frame],
        held_com=None if payload is None else np.array(payload.com, dtype=float),
    )


def _read_links(urdf: Path) -> tuple[Link, ...]:
    """The links beyond the base, parents before children."""
    read_elements(urdf)  # refuses what is no URDF
    with open_regular(urdf, limit=_LARGEST_URDF) as stream:
        root = ElementTree.parse(stream).getroot()
    inertials = {str(link.get("name")): link.find("inertial") for link in root.findall("link")}
    joints = {_name(joint, "parent"): [] for joint in root.findall("joint")}
    for joint in root.findall("joint"):
        joints[_name(joint, "parent")].append(joint)
    children = {_name(joint, "child") for joint in root.findall("joint")}
    waiting = [(name, -1) for name in inertials if name not in children]
    links: list[Link] = []
    while waiting:
        parent, number = waiting.pop(0)
        for joint in joints.get(parent, []):
            name, kind = _name(joint, "child"), str(joint.get("type"))
            if kind not in ("revolute", "continuous", "fixed"):
                raise FlexcalError(
                    "E-CELL-007",
                    f"{urdf}: the hard cell has no {kind} joints as '{joint.get('name')}'; use the virtual cell.",
                )
            translation, rotation = _pose(joint.find("origin"))
            axis = None if kind == "fixed" else _unit(_numbers(joint.find("axis"), "xyz", (1.0, 0.0, 0.0)))
            mass, com, inertia = _inertial(inertials[name])
            links.append(
                Link(name, str(joint.get("name")), number, translation, rotation, axis, mass, com, inertia)
            )
            waiting.append((name, len(links) - 1))
    _check_serial(urdf, links)
    return tuple(links)


def _check_serial(urdf: Path, links: list[Link]) -> None:
    carrier = -1
    for link in links:
        if link.axis is None:
            continue
        above = link.parent
        while above >= 0 and links[above].axis is None:
            above = links[above].parent
        if above != carrier:
            raise FlexcalError(
                "E-CELL-008",
                f"{urdf}: the hard cell has no branches as at '{link.joint}'; use the virtual cell.",
            )
        carrier = links.index(link)


def _inertial(element: ElementTree.Element | None) -> tuple[float, np.ndarray, np.ndarray]:
    if element is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    mass, tensor = element.find("mass"), element.find("inertia")
    com, rotation = _pose(element.find("origin"))
    moment = {
        key: 0.0 if tensor is None else float(tensor.get(key, "0"))
        for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    }
    own = np.array(
        [
            [moment["ixx"], moment["ixy"], moment["ixz"]],
            [moment["ixy"], moment["iyy"], moment["iyz"]],
            [moment["ixz"], moment["iyz"], moment["izz"]],
        ]
    )
    return 0.0 if mass is None else float(mass.get("value", "0")), com, rotation @ own @ rotation.T


def _pose(element: ElementTree.Element | None) -> tuple[np.ndarray, np.ndarray]:
    zero = (0.0, 0.0, 0.0)
    return np.array(_numbers(element, "xyz", zero)), _of_rpy(_numbers(element, "rpy", zero))


def _of_rpy(rpy: tuple[float, ...]) -> np.ndarray:
    """Rotation about the fixed axes x, y, z in turn, as URDF has it."""
    return Rotation.from_euler("xyz", rpy).as_matrix()


def _upright(axis: np.ndarray | None) -> np.ndarray:
    """Some right-handed frame with the axis as z."""
    z = np.array([0.0, 0.0, 1.0]) if axis is None else axis
    x = _unit(np.cross(np.eye(3)[np.argmin(np.abs(z))], z))
    return np.column_stack([x, np.cross(z, x), z])


def _unit(vector: tuple[float, ...] | np.ndarray) -> np.ndarray:
    return np.asarray(vector) / np.linalg.norm(vector)


def _numbers(
    element: ElementTree.Element | None, key: str, otherwise: tuple[float, ...]
) -> tuple[float, ...]:
    text = None if element is None else element.get(key)
    return otherwise if text is None else tuple(float(word) for word in text.split())


def _name(joint: ElementTree.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else str(element.get("link"))
