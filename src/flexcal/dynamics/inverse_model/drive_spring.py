"""Torque of the spring between motor and arm of an elastic joint, and its columns (Eq. 2.22)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from flexcal.dynamics.inverse_model.drive_terms import Column
from flexcal.dynamics.signals import Motion
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel


@dataclass(frozen=True)
class DriveBacklash:
    """Backlash in a drive: zero torque while q - θ is within `half_width` of `centre`, both in rad."""

    centre: float
    half_width: float


@dataclass(frozen=True)
class DriveSpring:
    """Drive spring of the elastic `joint` (its number), with `backlash` if estimated.

    The equation of the motor alone, which follows those of all joints, gains - `<joint>.drive.stiffness` (q - θ),
    - `.drive.damping` (q̇ - θ̇) and + `.drive.torque_offset`, τ_k0; with backlash also + `.drive.gap_torque` sign(q - θ - centre), the
    stiffness times half the gap, and none of them within the gap. Arm and motor together gain what turns and rubs on the arm side of
    the drive (Eq. 2.23a): `.arm_inertia` q̈, `.arm_viscous` q̇ and `.arm_coulomb` sign q̇. Thanks to them nothing that the arm's model
    misses, as bearing tilts, reaches the motor's inertia and friction, and through them the stiffness.
    """

    joint: int
    backlash: DriveBacklash | None = None

    def with_backlash(self, model: RobotModel, values: Mapping[str, float]) -> DriveSpring:
        """Spring with the backlash given by the named `values`."""
        name = f"{model.joint_names[self.joint]}.drive"
        stiffness = values[f"{name}.stiffness"]
        half_width = max(0.0, values.get(f"{name}.gap_torque", 0.0) / stiffness)
        return replace(self, backlash=DriveBacklash(values[f"{name}.torque_offset"] / stiffness, half_width))

    def columns(self, model: RobotModel, motion: Motion, motor: int) -> Iterator[Column]:
        """Columns of the spring; `motor` is the number of the motor's equation. Raises `FlexcalError` for a motion without arm side."""
        arm = motion.arm
        if arm is None:
            raise FlexcalError(
                "E-DYN-018", f"{motion.name} has no positions on the arm side of the elastic joints."
            )
        name, at = model.joint_names[self.joint], (slice(None), self.joint)
        twist, rate = arm.q[at] - motion.q[at], arm.dq[at] - motion.dq[at]
        yield Column(f"{name}.arm_inertia", self.joint, arm.ddq[at])
        yield Column(f"{name}.arm_viscous", self.joint, arm.dq[at])
        yield Column(f"{name}.arm_coulomb", self.joint, np.sign(arm.dq[at]))
        stretch = twist if self.backlash is None else twist - self.backlash.centre
        half_width = 0.0 if self.backlash is None else self.backlash.half_width
        touches = (np.abs(stretch) >= half_width).astype(float)
        yield Column(f"{name}.drive.stiffness", motor, -touches * twist)
        yield Column(f"{name}.drive.damping", motor, -touches * rate)
        yield Column(f"{name}.drive.torque_offset", motor, touches)
        if self.backlash is not None:  # last, so that recordings of one flank tell the offset and not the gap
            yield Column(f"{name}.drive.gap_torque", motor, touches * np.sign(stretch))


def coupled_columns(model: RobotModel, motion: Motion, motors: Mapping[int, int]) -> Iterator[Column]:
    """Columns of springs between the motors and a coupling in the motors' equations, whose numbers are `motors` by joint.

    Motor m, which also turns joint j by the ratio r, stretches its spring by (q - θ)_m + r (q - θ)_j: `<m>.drive.stiffness_at_<j>` is
    what either motor feels of the other's twist, r times the stiffness before the coupling, and zero for springs behind it. What a motor
    feels of its own twist stands in its own stiffness, r² of the other's before the coupling included. Damping likewise.
    """
    arm = motion.arm
    for entry in model.config.drives.coupling:
        m, j = model.joint_index(entry.motor), model.joint_index(entry.joint)
        if arm is None or m not in motors or j not in motors:
            continue
        for key, far, near in (("stiffness", arm.q, motion.q), ("damping", arm.dq, motion.dq)):
            twist = far - near
            name = f"{entry.motor}.drive.{key}_at_{entry.joint}"
            yield Column(name, motors[m], -entry.ratio * twist[:, j])
            yield Column(name, motors[j], -entry.ratio * twist[:, m])
