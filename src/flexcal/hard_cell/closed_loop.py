"""Hard cell's robot under its controller: one recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.hard_cell.equilibrium import StaticEquilibrium, stand, transmission_error
from flexcal.hard_cell.multibody import Multibody, build
from flexcal.hard_cell.true_parameters import HardRobot
from flexcal.mujoco_library import step_address

ENCODER_COUNTS = 2**18  # a turn at the joint
RATE_FILTER_HZ = 200.0
STEPS_PER_TICK = 2  # errors of a response to 80 Hz stay below 0.1 % then
UNRESOLVED = 2.0  # of h² k/m + 4 h d/m, which makes the kernel's step unstable at 4
BRISTLE_DAMPING = 0.5  # of bristles on the rotor: twice the damping ratio


@dataclass(frozen=True, eq=False)
class Command:
    """Command of the controller, all (ticks, m): torque on top of the loop's, angle and rate of the m moving motors; SI."""

    torque: np.ndarray
    angle: np.ndarray
    rate: np.ndarray


@dataclass(frozen=True, eq=False)
class MovingArm:
    """An arm whose motors `free` (m,) move, the others braked; at rest where it starts, with a step of `time_step` s."""

    robot: HardRobot
    arm: Multibody
    free: tuple[int, ...]
    start: np.ndarray
    time_step: float
    substeps: int


def moving_arm(
    robot: HardRobot,
    pose: np.ndarray,
    free: Sequence[int],
    payload: float,
    rate_hz: float,
    substeps: int = STEPS_PER_TICK,
) -> MovingArm:
    """The arm at rest at motor angles `pose` (n,) rad, ready to move.

    Springs too stiff for what they carry to be resolved by the step are left rigid: they vibrate far above what moves the robot.
    """
    joints, step = tuple(sorted(free)), 1 / (rate_hz * substeps)
    resting = stand(robot, whole := build(robot, payload=robot.carried(payload)), pose)
    arm = build(robot, payload=robot.carried(payload), free=joints, held_at=pose, time_step=step)
    rigid = _too_stiff(robot, arm, _angles(arm, whole, resting), step)
    if rigid:
        arm = build(
            robot, payload=robot.carried(payload), free=joints, held_at=pose, rigid=rigid, time_step=step
        )
    start = _angles(arm, whole, resting)
    for j in set(range(robot.n)) - set(
        joints
    ):  # a braked gear's error stays as it is: its spring counts from there
        if arm.hinge(j, "twist") >= 0:
            start[arm.hinge(j, "twist")] -= transmission_error(robot, pose)[j]
    return MovingArm(robot, arm, joints, start, step, substeps)


def run_loop(
    moving: MovingArm, command: Command, start_rate: np.ndarray, kp: np.ndarray, kd: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Encoder angles (ticks, m) rad and the torques (ticks, m) N m that the controller believes it held until the next tick.

    `start_rate` (m,) rad/s of the motors, `kp` and `kd` (m,) of the loop. Raises `FlexcalError` where the loop diverges.
    """
    import mujoco

    from flexcal import _kernels

    robot, arm, joints = moving.robot, moving.arm, list(moving.free)
    data = mujoco.MjData(arm.mjmodel)
    motors = np.array([arm.hinge(j, "motor") for j in joints], dtype=np.int64)
    twists = np.array([arm.hinge(j, "twist") for j in joints], dtype=np.int64)
    data.qpos[:] = moving.start
    data.qvel[motors] = start_rate
    ticks = moving.time_step * moving.substeps
    angle, torque = np.empty(command.torque.shape), np.empty(command.torque.shape)
    done = _kernels.geared_loop(
        step=step_address(),
        model=arm.mjmodel._address,
        data=data._address,
        angle=data.qpos,
        velocity=data.qvel,
        applied=data.qfrc_applied,
        hinges=_hinges(robot, arm),
        motors=motors,
        twists=twists,
        frictions=_frictions(robot)[joints],
        errors=np.column_stack([robot.arm.ratio, robot.error_amplitude, robot.error_phase])[joints],
        gains=np.column_stack([robot.torque_gain[joints], kp, kd]),
        tick=ticks,
        substeps=moving.substeps,
        count=2 * np.pi / ENCODER_COUNTS,
        filter=-np.expm1(-2 * np.pi * RATE_FILTER_HZ * ticks),
        torque=np.ascontiguousarray(command.torque),
        reference=np.ascontiguousarray(command.angle),
        reference_rate=np.ascontiguousarray(command.rate),
        angle_log=angle,
        torque_log=torque,
    )
    if done < len(angle):
        raise FlexcalError(
            "E-CELL-004",
            f"the hard cell's loop diverged after {done * ticks:.3g} s; lower kp, kd or the excitation.",
        )
    return angle, torque


def _angles(arm: Multibody, whole: Multibody, resting: StaticEquilibrium) -> np.ndarray:
    """The rest angles (d,) of the hinges that an arm has."""
    return np.array([resting.angles[whole.hinge(j, part)] for j, part in arm.hinges])


def _hinges(robot: HardRobot, arm: Multibody) -> np.ndarray:
    """Stiffness, damping, half gap, hardening, stiffness and twist limit of the slipping element (d, 6) of all hinges."""
    none = np.zeros((robot.n, 3))
    backlash, slipping, limit = none.copy(), none.copy(), none.copy()
    backlash[:, 2] = robot.backlash
    stiffness = np.where(np.isfinite(robot.arm.springs), robot.arm.springs, 0.0)
    slipping[:, 2] = stiffness[:, 2] * robot.hysteresis / robot.slip_twist
    limit[:, 2] = robot.slip_twist
    return np.column_stack(
        [arm.springs(v) for v in (stiffness, robot.arm.dampers, backlash, robot.hardening, slipping, limit)]
    )


def _frictions(robot: HardRobot) -> np.ndarray:
    """The friction of every motor as the kernel takes it, (n, 7)."""
    bristles = robot.arm.coulomb / robot.bristle
    return np.column_stack(
        [
            robot.arm.viscous,
            robot.arm.coulomb,
            robot.stribeck,
            robot.stribeck_velocity,
            robot.per_load,
            bristles,
            BRISTLE_DAMPING * np.sqrt(bristles * robot.arm.rotor_inertia),
        ]
    )


def _too_stiff(
    robot: HardRobot, arm: Multibody, angles: np.ndarray, step: float
) -> tuple[tuple[int, str], ...]:
    """Springs that alone would vibrate too fast for a step, the other hinges free."""
    import mujoco

    arm.gravity(angles)
    d = len(angles)
    mass = np.empty((d, d))
    for row, unit in zip(mass, np.eye(d), strict=True):
        mujoco.mj_mulM(arm.mjmodel, arm.data, row, unit)
    stiffness = np.where(np.isfinite(robot.arm.springs), robot.arm.springs, 0.0)
    speed = step**2 * arm.springs(stiffness) + 4 * step * arm.springs(robot.arm.dampers)
    steep = speed * np.diag(np.linalg.inv(mass)) > UNRESOLVED
    return tuple(hinge for hinge, out in zip(arm.hinges, steep, strict=True) if out)
