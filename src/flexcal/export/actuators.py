"""Position-controlled actuators of a robot, as simulators take them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flexcal.estimation import Estimate
from flexcal.model.robot import RobotModel

OF_ERROR = "velocity error"
"""Provenance `option.damping` of actuators whose damping acts on the difference from the commanded velocity."""
COMPENSATED = "compensated"
"""Provenance `option.gravity` of actuators whose controller adds the torques that hold the links."""
_UNITS = {
    "stiffness": ("N m/rad", "N/m"),
    "damping": ("N m s/rad", "N s/m"),
    "viscous": ("N m s/rad", "N s/m"),
    "coulomb": ("N m", "N"),
    "armature": ("kg m²", "kg"),
    "delay": ("s", "s"),
}


@dataclass(frozen=True, eq=False)
class Actuators:
    """Actuators of n joints under a position controller, all (n,) and referred to the joints (N m, rad; N, m where prismatic).

    With the command u, the torque on a joint is K (u(t − T) − q) − D q̇ − d q̇ − f sgn q̇, and the rotor adds A to the inertia:
    `stiffness` K, `damping` D, `viscous` d, `coulomb` f, `armature` A, `delay` T (s). Where the damping acts on the velocity error
    (`follows_velocity`), D (u̇(t − T) − q̇) stands in place of −D q̇; else D and d have one effect, and d is zero unless D is known. Where
    the controller `compensates_gravity`, it adds the torques that hold the links.
    """

    stiffness: np.ndarray
    damping: np.ndarray
    viscous: np.ndarray
    coulomb: np.ndarray
    armature: np.ndarray
    delay: np.ndarray
    follows_velocity: bool = False
    compensates_gravity: bool = False

    KEYS: ClassVar[tuple[str, ...]] = tuple(_UNITS)

    @classmethod
    def of(cls, model: RobotModel, estimate: Estimate) -> Actuators:
        """Actuators of a block `actuators` of estimates.yaml; what is not in it is zero."""
        values = estimate.values
        numbers = {
            key: np.array([values.get(actuator_name(joint, key), 0.0) for joint in model.joint_names])
            for key in cls.KEYS
        }
        said = estimate.provenance
        return cls(
            **numbers,
            follows_velocity=said.get("option.damping") == OF_ERROR,
            compensates_gravity=said.get("option.gravity") == COMPENSATED,
        )


def actuator_name(joint: str, key: str) -> str:
    """Name of an actuator's parameter, `<joint>.actuator.<key>`."""
    return f"{joint}.actuator.{key}"


def actuator_unit(model: RobotModel, joint: int, key: str) -> str:
    """SI unit of a parameter of the actuator of a joint."""
    return _UNITS[key][model.joints[joint].kind == "prismatic"]
