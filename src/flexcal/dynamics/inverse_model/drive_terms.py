"""Torque terms of the drives, linear in their parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel, unknown_parallel

Memory = dict[str, Any]
"""State of the terms between blocks of an experiment; empty at its start."""


@dataclass(frozen=True, eq=False)
class Column:
    """Torque (N,) per unit of the parameter `name` at one joint, given by the number of its equation in an `Observation`."""

    name: str
    joint: int
    values: np.ndarray


class DriveTerm(Protocol):
    """Term of the torques with one or more parameters of its own."""

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        """Columns of the term, in a stable order; a parameter that acts on several joints has one for each.

        `motion` continues what `memory` is of, which is brought up to its end.
        """
        ...


class _PerJoint:
    """Term with one parameter per joint, which acts on that joint alone."""

    key: ClassVar[str]

    def shape(self, motion: Motion) -> np.ndarray:
        raise NotImplementedError

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        shape = self.shape(motion)
        for i, name in enumerate(model.joint_names):
            yield Column(f"{name}.{self.key}", i, shape[:, i])


@dataclass(frozen=True)
class RotorInertia(_PerJoint):
    """Rotor inertia, `<joint>.rotor_inertia` · q̈."""

    key = "rotor_inertia"

    def shape(self, motion: Motion) -> np.ndarray:
        return motion.ddq


@dataclass(frozen=True)
class Viscous(_PerJoint):
    """Viscous friction, `<joint>.viscous` · q̇."""

    key = "viscous"

    def shape(self, motion: Motion) -> np.ndarray:
        return motion.dq


@dataclass(frozen=True)
class Coulomb(_PerJoint):
    """Coulomb friction, `<joint>.coulomb` · sign q̇."""

    key = "coulomb"

    def shape(self, motion: Motion) -> np.ndarray:
        return np.sign(motion.dq)


@dataclass(frozen=True)
class TorqueOffset(_PerJoint):
    """Torque offset `<joint>.torque_offset`: direction-dependent Coulomb friction and the offset of the torque measurement."""

    key = "torque_offset"

    def shape(self, motion: Motion) -> np.ndarray:
        return np.ones_like(motion.dq)


@dataclass(frozen=True)
class Coupling:
    """Coupled motors that also turn another joint (`drives: coupling:`): motor m turns at s = q_m + ratio · q_j.

    `<m>.rotor_inertia_at_<j>` and `<m>.viscous_at_<j>` are what either joint feels of the other's motion, `<m>.coulomb_at_<j>` what both
    feel of sign ṡ. What each joint feels of its own motion stands in its own rotor inertia and viscous friction.
    """

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        for entry in model.config.drives.coupling:
            motor, joint, ratio = model.joint_index(entry.motor), model.joint_index(entry.joint), entry.ratio
            sign = np.sign(motion.dq[:, motor] + ratio * motion.dq[:, joint])
            for key, on_motor, on_joint in (
                ("rotor_inertia", ratio * motion.ddq[:, joint], ratio * motion.ddq[:, motor]),
                ("viscous", ratio * motion.dq[:, joint], ratio * motion.dq[:, motor]),
                ("coulomb", sign, ratio * sign),
            ):
                yield Column(f"{entry.motor}.{key}_at_{entry.joint}", motor, on_motor)
                yield Column(f"{entry.motor}.{key}_at_{entry.joint}", joint, on_joint)


@dataclass(frozen=True)
class JointSprings:
    """Springs and cables parallel to joints, declared in `dynamics:` without a value.

    `<joint>.spring_stiffness` · (q - rest), or · q beside `<joint>.spring_torque` where the rest is not declared; `<joint>.cable_torque`.
    Both constants equal a torque offset, which absorbs them where it is among the terms. Behind an elastic drive they act on the arm.
    """

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        rests = {entry.joint: entry.rest or 0.0 for entry in model.config.dynamics.joint_springs}
        for i, name in enumerate(model.joint_names):
            q = motion.q[:, i]
            for key in unknown_parallel(model, name):
                values = q - rests[name] if key == "spring_stiffness" else np.ones_like(q)
                yield Column(f"{name}.{key}", i, values)


CLASSIC: tuple[DriveTerm, ...] = (
    RotorInertia(),
    Viscous(),
    Coulomb(),
    TorqueOffset(),
    Coupling(),
    JointSprings(),
)
"""Terms counted in the structural rank."""
