"""Slow reference motion under the excitation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium
from flexcal.model.vibration import ElasticArm


@dataclass(frozen=True, eq=False)
class ArmState:
    """Configuration, velocity and acceleration (nv,) of an `ElasticArm`."""

    configuration: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


@dataclass(frozen=True)
class ReferenceMotion:
    """Reference motion amplitude · sin(2π frequency_hz t) of all excited axes, `amplitude` in rad, with controller gains `kp`, `kd` (E,).

    `excitation` (E, L) N m are the cosine amplitudes of the multisine in each orthogonal experiment's share of an axis. At the
    sidebands the controller's torque belongs to the system; at the excited line it is part of the measured torque.
    """

    amplitude: float
    frequency_hz: float
    kp: np.ndarray
    kd: np.ndarray
    excitation: np.ndarray

    @classmethod
    def of(cls, plan: MultisinePlan) -> ReferenceMotion:
        """Reference motion of a plan."""
        axes = list(plan.joints)
        share = plan.amplitude / np.sqrt(len(axes))
        return cls(plan.reference_amplitude, plan.reference_frequency_hz, plan.kp[axes], plan.kd[axes], share)

    def states(self, robot: RobotModel, arm: ElasticArm, q: np.ndarray, phases: int) -> Iterator[ArmState]:
        """Arm states at `phases` instants of a cycle, following its motors rigidly about rest at `q` (n,) rad."""
        rest = static_equilibrium(robot, q, arm.payload)
        still = arm.configuration(np.asarray(q, dtype=float), rest.deflection[0])
        axes = arm.joint_velocity[[joint.index for joint in robot.driven]]
        omega = 2 * np.pi * self.frequency_hz
        for angle in 2 * np.pi * np.arange(phases) / phases:
            at, velocity, acceleration = still.copy(), np.zeros(arm.model.nv), np.zeros(arm.model.nv)
            at[axes] += self.amplitude * np.sin(angle)
            velocity[axes] = self.amplitude * omega * np.cos(angle)
            acceleration[axes] = -self.amplitude * omega**2 * np.sin(angle)
            yield ArmState(at, velocity, acceleration)
