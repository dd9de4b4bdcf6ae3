"""What the slow motion under the excitation does to the frequency response: the arm's inertia changes along it.

About a periodic motion the linearised robot is linear time-periodic, M(t) δ̈ + D(t) δ̇ + K(t) δ = B τ. Its response at the excited
frequency, by harmonic balance with the sidebands (Wereley 1990), differs from that at rest: resonances that wander are blunted, which a
fit at rest takes for damping of the bearings.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from flexcal.data import MultisinePlan
from flexcal.model import RobotModel, static_equilibrium
from flexcal.model.elastic_arm import ElasticArm
from flexcal.model.linearisation import linearise
from flexcal.model.transfer import transfer_matrix


@dataclass(frozen=True, eq=False)
class ArmState:
    """Configuration, velocity and acceleration (nv,) of an `ElasticArm`."""

    configuration: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


@dataclass(frozen=True)
class ReferenceMotion:
    """All excited axes move by amplitude · sin(2π frequency_hz t), `amplitude` in rad, held by a controller of gains `kp`, `kd` (E,).

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
        """The reference motion of a plan."""
        axes = list(plan.joints)
        share = plan.amplitude / np.sqrt(len(axes))
        return cls(plan.reference_amplitude, plan.reference_frequency_hz, plan.kp[axes], plan.kd[axes], share)

    def states(self, robot: RobotModel, arm: ElasticArm, q: np.ndarray, phases: int) -> Iterator[ArmState]:
        """The arm at `phases` instants of a cycle, following its motors rigidly about rest at `q` (n,) rad."""
        rest = static_equilibrium(robot, q, arm.payload)
        still = arm.configuration(np.asarray(q, dtype=float), rest.deflection[0])
        axes = arm.joint_velocity[[joint.index for joint in robot.elastic]]
        omega = 2 * np.pi * self.frequency_hz
        for angle in 2 * np.pi * np.arange(phases) / phases:
            at, velocity, acceleration = still.copy(), np.zeros(arm.model.nv), np.zeros(arm.model.nv)
            at[axes] += self.amplitude * np.sin(angle)
            velocity[axes] = self.amplitude * omega * np.cos(angle)
            acceleration[axes] = -self.amplitude * omega**2 * np.sin(angle)
            yield ArmState(at, velocity, acceleration)


def reference_shift(
    robot: RobotModel,
    q: np.ndarray,
    payload: float | None,
    frequencies_hz: np.ndarray,
    motion: ReferenceMotion,
    *,
    sidebands: int = 2,
    phases: int = 8,
) -> np.ndarray:
    """G under the reference motion less G at rest, (L, E, E) rad/s² per N m, for motors about `q` (n,) with `payload` kg.

    `sidebands` on either side are balanced; the motion is sampled at `phases` instants. The arm follows its motors rigidly.
    """
    rest = linearise(robot, q, payload)
    still = transfer_matrix(rest, frequencies_hz).response
    if motion.amplitude == 0.0:
        return np.zeros_like(still)
    constant = (rest.mass.copy(), rest.damping, rest.stiffness.copy())
    count, size = rest.inputs, len(rest.mass)
    arm = ElasticArm(robot, payload)
    sampled = [_arm_matrices(arm, state) for state in motion.states(robot, arm, q, phases)]
    mass, damping, stiffness = _harmonics(sampled, sidebands)
    still_arm = next(replace(motion, amplitude=0.0).states(robot, arm, q, 1))
    at_rest = _arm_matrices(arm, still_arm)
    constant[0][count:, count:] -= at_rest[0]
    constant[2][count:, count:] -= at_rest[2]
    orders = np.arange(-sidebands, sidebands + 1)
    s = 2j * np.pi * (frequencies_hz[:, None] + orders * motion.frequency_hz)
    system = np.zeros((len(frequencies_hz), len(orders), size, len(orders), size), dtype=complex)
    for row in range(len(orders)):
        for column in range(len(orders)):
            order = row - column
            at = s[:, column, None, None]
            block = np.zeros((len(s), size, size), dtype=complex)
            if abs(order) <= sidebands:
                k = order + sidebands
                block[:, count:, count:] = at**2 * mass[k] + at * damping[k] + stiffness[k]
            if order == 0:
                block += at**2 * constant[0] + at * constant[1] + constant[2]
                if column != sidebands:
                    loop = motion.kp + at[:, :, 0] * motion.kd
                    block[:, range(count), range(count)] += loop
            system[:, row, :, column] = block
    width = len(orders) * size
    middle = sidebands * size
    forces = np.zeros((width, count))
    forces[middle : middle + count] = np.eye(count)
    moved = np.linalg.solve(system.reshape(-1, width, width), np.broadcast_to(forces, (len(s), width, count)))
    return s[:, sidebands, None, None] ** 2 * moved[:, middle : middle + count] - still


def _harmonics(
    sampled: list[tuple[np.ndarray, np.ndarray, np.ndarray]], sidebands: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fourier coefficients (2 sidebands + 1, d, d) of M, D and K of the arm over one cycle, from order -sidebands."""
    angles = 2 * np.pi * np.arange(len(sampled)) / len(sampled)
    orders = np.arange(-sidebands, sidebands + 1)
    turn = np.exp(-1j * np.outer(orders, angles)) / len(sampled)
    mass, damping, stiffness = (
        np.tensordot(turn, np.array(kind), axes=1) for kind in zip(*sampled, strict=True)
    )
    return mass, damping, stiffness


def _arm_matrices(arm: ElasticArm, state: ArmState) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, ∂τ/∂q̇ and ∂τ/∂q (d, d) of the elastic coordinates in one state, springs left out."""
    import pinocchio as pin

    by_q, by_v, _ = pin.computeRNEADerivatives(
        arm.model, arm.data, state.configuration, state.velocity, state.acceleration
    )
    index = np.ix_(arm.elastic, arm.elastic)
    return arm.mass_matrix(state.configuration), np.array(by_v)[index], np.array(by_q)[index]
