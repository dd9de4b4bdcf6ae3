"""The arm as MuJoCo bodies and hinges, written as XML."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from flexcal.hard_cell.description import ArmDescription
from flexcal.hard_cell.true_parameters import PAYLOAD_RADIUS, HardRobot
from flexcal.mujoco_library import log_mujoco_warnings

if TYPE_CHECKING:
    import mujoco

COMPONENTS = ("tilt_x", "tilt_y", "twist")
_OFF = ("constraint", "contact", "eulerdamp", "autoreset", "warmstart", "midphase", "actuation", "sensor")
_POINT = "reflector"


@dataclass(frozen=True, eq=False)
class Multibody:
    """A compiled arm of d hinges. `hinges` (d,): joint and part of each, "motor" or a spring's; `loaded` tells what the last link holds."""

    mjmodel: mujoco.MjModel
    hinges: tuple[tuple[int, str], ...]
    data: mujoco.MjData

    def hinge(self, joint: int, part: str) -> int:
        """Coordinate of a part of a joint, -1 where it has none."""
        return self.hinges.index((joint, part)) if (joint, part) in self.hinges else -1

    def springs(self, per_joint: np.ndarray) -> np.ndarray:
        """Values (d,) of the hinges out of those of the springs (n, 3); motors have 0."""
        return np.array(
            [0.0 if part == "motor" else per_joint[j, COMPONENTS.index(part)] for j, part in self.hinges]
        )

    def gravity(self, angles: np.ndarray) -> np.ndarray:
        """Torque (d,) N m of gravity on the hinges at rest at `angles` (d,) rad, as the springs and motors must hold it."""
        import mujoco

        self.data.qpos[:] = angles
        self.data.qvel[:] = 0
        mujoco.mj_fwdPosition(self.mjmodel, self.data)
        mujoco.mj_rne(self.mjmodel, self.data, 0, torque := np.empty(self.mjmodel.nv))
        return torque

    @property
    def point(self) -> np.ndarray:
        """The reflector in the base frame, m, where `gravity` was last asked for."""
        return self.data.site(_POINT).xpos.copy()


def build(
    robot: HardRobot,
    *,
    payload: float | None = None,
    free: Collection[int] | None = None,
    held_at: np.ndarray | None = None,
    rigid: Collection[tuple[int, str]] = (),
    time_step: float = 1e-3,
) -> Multibody:
    """The arm with springs, its motors outside `free` braked at `held_at` (n,) rad, and without the springs in `rigid`.

    `payload` kg, None for the declared. Bearings tilt before the motor turns where their axes are fixed to the parent, after it otherwise.
    """
    import mujoco

    log_mujoco_warnings()
    arm = robot.arm
    root = ElementTree.Element("mujoco", model="arm")
    ElementTree.SubElement(root, "compiler", angle="radian", inertiafromgeom="false", balanceinertia="true")
    option = ElementTree.SubElement(
        root, "option", timestep=repr(time_step), gravity=_text(arm.gravity), integrator="Euler"
    )
    ElementTree.SubElement(option, "flag", dict.fromkeys(_OFF, "disable"))
    bodies = [ElementTree.SubElement(root, "worldbody")]
    for k, link in enumerate(arm.links):
        turned, j, motor, at = link.rotation, -1, False, 0.0
        if link.axis is not None:
            j = arm.joints.index(k)
            motor = free is None or j in free
            at = 0.0 if motor or held_at is None else float(held_at[j])
            turned = link.rotation @ Rotation.from_rotvec(at * link.axis).as_matrix()
        body = ElementTree.SubElement(
            bodies[link.parent + 1],
            "body",
            name=link.name,
            pos=_text(link.translation),
            quat=_quaternion(turned),
        )
        bodies.append(body)
        mass, com, inertia = _loaded(arm, k, arm.payload if payload is None else payload)
        if mass > 0:
            moments = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
            ElementTree.SubElement(
                body, "inertial", mass=repr(float(mass)), pos=_text(com), fullinertia=_text(moments)
            )
        if link.axis is not None:
            for part in _parts(robot, j, motor, rigid):
                axis = link.axis if part in ("motor", "twist") else arm.bearing[j][:, COMPONENTS.index(part)]
                if robot.bearings_before and part.startswith("tilt"):
                    axis = Rotation.from_rotvec(-at * link.axis).apply(axis)
                rotor = arm.rotor_inertia[j] if part == "motor" else 0.0
                ElementTree.SubElement(
                    body,
                    "joint",
                    name=f"{j}.{part}",
                    type="hinge",
                    axis=_text(axis),
                    armature=repr(float(rotor)),
                )
        if k == arm.point[1]:
            ElementTree.SubElement(body, "site", name=_POINT, pos=_text(arm.point[2]))
    compiled = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    names = (compiled.joint(i).name.split(".") for i in range(compiled.njnt))
    return Multibody(compiled, tuple((int(j), part) for j, part in names), mujoco.MjData(compiled))


def _parts(robot: HardRobot, j: int, motor: bool, rigid: Collection[tuple[int, str]]) -> list[str]:
    """Hinges of a joint, the first on the parent."""
    tilts, turns = ["tilt_x", "tilt_y"], ["motor", "twist"]
    parts = tilts + turns if robot.bearings_before else turns + tilts
    elastic = {name for k, name in enumerate(COMPONENTS) if np.isfinite(robot.arm.springs[j, k])}
    return [p for p in parts if (motor if p == "motor" else p in elastic and (j, p) not in rigid)]


def _loaded(arm: ArmDescription, k: int, payload: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre of mass and inertia about it of a link and of the ball of `payload` kg that it may hold."""
    link = arm.links[k]
    if k != arm.held_link or payload <= 0 or arm.held_com is None:
        return link.mass, link.com, link.inertia
    mass = link.mass + payload
    com = (link.mass * link.com + payload * arm.held_com) / mass
    inertia = link.inertia + 0.4 * payload * PAYLOAD_RADIUS**2 * np.eye(3)
    for part, place in ((link.mass, link.com - com), (payload, arm.held_com - com)):
        inertia = inertia + part * (place @ place * np.eye(3) - np.outer(place, place))
    return mass, com, inertia


def _text(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _quaternion(rotation: np.ndarray) -> str:
    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    return _text(np.array([w, x, y, z]))
