"""Frequency response along the slow reference motion, by harmonic balance: the arm's inertia changes, and gaps open in phase with it.

About a periodic motion the linearised robot is linear time-periodic, M(t) δ̈ + D(t) δ̇ + K(t) δ = B τ. Its response at the excited
frequency, by harmonic balance with the sidebands (Wereley 1990), differs from that at rest: resonances that wander are blunted, which a
fit at rest takes for damping of the bearings. Both changes belong into one balance: axis 1 reaches the drive of axis 3 by Coriolis
forces at the sidebands, and the gap that opens once a cycle brings them back to the line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.elasticity.time_periodic.moving_sensors import MovingSensor, harmonics
from flexcal.elasticity.time_periodic.reference_motion import ArmState, ReferenceMotion
from flexcal.model.robot import ArmSensor, RobotModel
from flexcal.model.vibration import ElasticArm, drive_stretch, linearise, transfer_matrix

ARM_SIDEBANDS, GAP_SIDEBANDS = 2, 6
"""Multiples of the reference frequency balanced on either side of the excited line, without and with open gaps."""

ARM_PHASES = 8
"""Number of instants of the reference motion at which the arm's matrices are evaluated."""

ARM_HARMONICS = 2
"""Highest harmonic of the arm's matrices: the next is smaller by a factor of the amplitude (rad)."""


def reference_shift(
    robot: RobotModel,
    q: np.ndarray,
    payload: float | None,
    frequencies_hz: np.ndarray,
    motion: ReferenceMotion,
    opening: np.ndarray | None = None,
    sensors: Sequence[ArmSensor] = (),
) -> np.ndarray:
    """Difference of G under the reference motion from G at rest, (L, E + S, E), for motors about `q` (n,) with `payload` kg and
    `sensors` on the arm.

    Rows are rad/s² per N m, then the sensors' readings.

    `opening` (2, phases, E) are the shares of stiffness and damping of every drive of `robot` that are missing at that phase of the motion,
    with their mean put back: the drives of `robot` have their mean softness. The arm follows its motors rigidly.
    """
    rest = linearise(robot, q, payload, sensors=sensors)
    still = transfer_matrix(rest, frequencies_hz).response
    if motion.amplitude == 0.0:
        return np.zeros_like(still)
    count, size = rest.inputs, len(rest.mass)
    sidebands = ARM_SIDEBANDS if opening is None or not opening.any() else GAP_SIDEBANDS
    mass, damping, stiffness = _arm_changes(robot, q, payload, motion, size, sidebands)
    mass[2 * sidebands] += rest.mass
    damping[2 * sidebands] += rest.damping
    stiffness[2 * sidebands] += rest.stiffness
    if opening is not None:
        pull = drive_stretch(robot, rest)
        for changed, share, of in (
            (stiffness, opening[0], [drive.stiffness[2] for drive in robot.driven]),
            (damping, opening[1], [drive.damping[2] for drive in robot.driven]),
        ):
            released = np.einsum("g,kg,dg,eg->kde", of, harmonics(share, 2 * sidebands), pull, pull)
            released[2 * sidebands] = 0.0
            changed -= released
    orders = np.arange(-sidebands, sidebands + 1)
    s = 2j * np.pi * (frequencies_hz[:, None] + orders * motion.frequency_hz)
    system = np.empty((len(s), len(orders), size, len(orders), size), dtype=complex)
    polynomial = np.stack([stiffness, damping, mass])
    for column in range(len(orders)):
        rows = slice(2 * sidebands - column, 4 * sidebands + 1 - column)  # by their order less the column's
        powers = s[:, column, None] ** np.arange(3)
        block = powers @ polynomial[:, rows].reshape(3, -1)
        system[:, :, :, column] = block.reshape(len(s), len(orders), size, size)
        if column != sidebands:
            loop = motion.kp + s[:, column, None] * motion.kd
            system[:, column, range(count), column, range(count)] += loop
    width, middle = len(orders) * size, sidebands * size
    forces = np.zeros((width, count))
    forces[middle : middle + count] = np.eye(count)
    moved = np.linalg.solve(system.reshape(-1, width, width), np.broadcast_to(forces, (len(s), width, count)))
    moving = s[:, sidebands, None, None] ** 2 * moved[:, middle : middle + count]
    if sensors:
        arm = ElasticArm(robot, payload)
        cycle = [state.configuration for state in motion.states(robot, arm, q, ARM_PHASES)]
        elastic = moved.reshape(len(s), len(orders), size, count)[:, :, size - len(arm.elastic) :]
        read = [MovingSensor.of(arm, x, cycle, motion.frequency_hz).reading(elastic, s) for x in sensors]
        moving = np.concatenate([moving, np.stack(read, axis=1)], axis=1)
    return moving - still


def _arm_changes(
    robot: RobotModel,
    q: np.ndarray,
    payload: float | None,
    motion: ReferenceMotion,
    size: int,
    sidebands: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fourier coefficients (4 sidebands + 1, size, size) of M, D and K along the motion less those at rest, from order -2 sidebands."""
    arm = ElasticArm(robot, payload)
    still = _arm_matrices(arm, next(replace(motion, amplitude=0.0).states(robot, arm, q, 1)))
    moving = [_arm_matrices(arm, state) for state in motion.states(robot, arm, q, ARM_PHASES)]
    first = size - len(arm.elastic)
    changes = []
    for rest, sampled in zip(still, zip(*moving, strict=True), strict=True):
        change = np.zeros((4 * sidebands + 1, size, size), dtype=complex)
        middle = slice(2 * sidebands - ARM_HARMONICS, 2 * sidebands + ARM_HARMONICS + 1)
        change[middle, first:, first:] = harmonics(np.array(sampled) - rest, ARM_HARMONICS)
        changes.append(change)
    return changes[0], changes[1], changes[2]


def _arm_matrices(arm: ElasticArm, state: ArmState) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matrices M, ∂τ/∂q̇ and ∂τ/∂q (d, d) of the elastic coordinates in one state, springs excluded."""
    import pinocchio as pin

    by_q, by_v, _ = pin.computeRNEADerivatives(
        arm.model, arm.data, state.configuration, state.velocity, state.acceleration
    )
    index = np.ix_(arm.elastic, arm.elastic)
    return arm.mass_matrix(state.configuration), np.array(by_v)[index], np.array(by_q)[index]
