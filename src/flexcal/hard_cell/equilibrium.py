"""Static equilibrium of the hard cell's arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.hard_cell.multibody import Multibody
from flexcal.hard_cell.true_parameters import HardRobot

ITERATIONS, TOLERANCE = 60, 1e-13


@dataclass(frozen=True, eq=False)
class StaticEquilibrium:
    """All hinges (d,) rad at rest, the torque (n,) N m of every motor against gravity, the reflector (3,) m in the base frame."""

    angles: np.ndarray
    torque: np.ndarray
    point: np.ndarray


def spring_twist(torque: np.ndarray, stiffness: np.ndarray, hardening: np.ndarray) -> np.ndarray:
    """Twist x (d,) rad at which k (x + a x³) is `torque` (d,) N m, `stiffness` k and `hardening` a (d,); Newton's method from x = T/k."""
    soft = torque / stiffness
    twist = soft.copy()
    for _ in range(20):
        twist -= (twist + hardening * twist**3 - soft) / (1 + 3 * hardening * twist**2)
    return twist


def transmission_error(robot: HardRobot, motors: np.ndarray) -> np.ndarray:
    """Transmission error (n,), rad, of the gears: harmonics 1 and 2 of the joint and of the motor."""
    ratio = robot.arm.ratio
    order = np.column_stack([np.ones_like(ratio), 2 * np.ones_like(ratio), ratio, 2 * ratio])
    return (robot.error_amplitude * np.sin(order * motors[:, None] + robot.error_phase)).sum(axis=1)


def stand(
    robot: HardRobot,
    arm: Multibody,
    motors: np.ndarray,
    *,
    slip: np.ndarray | None = None,
    scatter: np.ndarray | None = None,
) -> StaticEquilibrium:
    """The arm at rest with motors at `motors` (n,) rad; all of them must be hinges of `arm`.

    `slip` (n,) in [-1, 1] is the state of each drive's hysteresis, `scatter` (n,) rad an error of each gear at this visit. The balance is
    found by repetition: springs give way to the gravity of the last round, which changes little by it. Raises `FlexcalError`
    where that does not end.
    """
    n = robot.n
    motor = np.array([arm.hinge(j, "motor") for j in range(n)])
    twist = np.array([arm.hinge(j, "twist") for j in range(n)])
    elastic = np.array([part != "motor" for _, part in arm.hinges])
    stiffness = np.where(elastic, arm.springs(robot.arm.springs), 1.0)
    hardening = arm.springs(robot.hardening)
    backlash, offset, load = (np.zeros(len(arm.hinges)) for _ in range(3))
    driven = twist >= 0
    backlash[twist[driven]] = robot.backlash[driven]
    free = transmission_error(robot, motors) + (0.0 if scatter is None else scatter)
    offset[twist[driven]] = free[driven]
    if slip is not None:
        load[twist[driven]] = (robot.hysteresis * slip)[driven] * robot.arm.springs[driven, 2]
    angles = np.zeros(len(arm.hinges))
    angles[motor] = motors + np.where(driven, 0.0, free)
    for _ in range(ITERATIONS):
        torque = -arm.gravity(angles) - load
        balanced = spring_twist(torque, stiffness, hardening) + backlash * np.sign(torque) + offset
        moved = np.abs(balanced - angles)[elastic].max(initial=0.0)
        angles[elastic] = balanced[elastic]
        if moved < TOLERANCE:
            torque_at_rest = arm.gravity(angles)
            return StaticEquilibrium(angles, torque_at_rest[motor], arm.point)
    raise FlexcalError(
        "E-CELL-009",
        "the hard cell's robot has no stable equilibrium: its springs are too soft for gravity; check the stiffness values.",
    )
