"""Linearised robot under position control: motion and drive torques due to an added torque."""

from __future__ import annotations

import numpy as np

from flexcal.model.robot import RobotModel
from flexcal.model.statics import elastic_axes
from flexcal.model.vibration.linearisation import Linearisation


def closed_loop_motion(
    system: Linearisation, frequencies_hz: np.ndarray, kp: np.ndarray, kd: np.ndarray
) -> np.ndarray:
    """Displacements (L, E + d, E), rad per N m added to each motor, at `frequencies_hz` (L,); gains (E,) of the motors' loops.

    (M s² + D s + K + kp + kd s)⁻¹ B, the gains on the motors' coordinates alone.
    """
    s = 2j * np.pi * np.asarray(frequencies_hz, dtype=float)[:, None, None]
    dynamics = s**2 * system.mass + s * system.damping + system.stiffness
    motors = range(system.inputs)
    dynamics[:, motors, motors] += kp + s[:, :, 0] * kd
    forces = np.eye(len(system.mass), system.inputs)
    return np.linalg.solve(dynamics, np.broadcast_to(forces, (len(s), *forces.shape)))


def drive_stretch(robot: RobotModel, system: Linearisation, *, held: bool = False) -> np.ndarray:
    """Direction (E + d, E) in which each drive's spring is stretched: its twist less its motor. With `held`, those of the held drives,
    whose motors stand still, are among them.
    """
    drives = robot.elastic if held else robot.driven
    axes, driven = elastic_axes(robot), [joint.index for joint in robot.driven]
    pull = np.zeros((len(system.mass), len(drives)))
    for column, joint in enumerate(drives):
        pull[system.inputs + axes.index((joint.index, 2)), column] = 1.0
        if joint.index in driven:
            pull[driven.index(joint.index), column] = -1.0
    return pull


def strain_power(
    robot: RobotModel,
    system: Linearisation,
    frequencies_hz: np.ndarray,
    kp: np.ndarray,
    kd: np.ndarray,
    *,
    held: bool = False,
) -> np.ndarray:
    """Mean square (L, E, E) of the torque in each elastic drive's spring due to a cosine of 1 N m added to each motor (last); with `held`,
    of the held drives (second) too.
    """
    stiffness = np.array([joint.stiffness[2] for joint in (robot.elastic if held else robot.driven)])
    moved = closed_loop_motion(system, frequencies_hz, kp, kd)
    return 0.5 * np.abs(stiffness[:, None] * (drive_stretch(robot, system, held=held).T @ moved)) ** 2


def multisine_torque(
    robot: RobotModel,
    system: Linearisation,
    frequencies_hz: np.ndarray,
    excitation: np.ndarray,
    kp: np.ndarray,
    kd: np.ndarray,
) -> np.ndarray:
    """Standard deviation (E,) N m of the torque in each elastic drive's spring under multisines of independent phases.

    `excitation` (E, L) N m are the cosine amplitudes added to the motors; otherwise as in `closed_loop_motion`.
    """
    power = strain_power(robot, system, frequencies_hz, kp, kd)
    return np.sqrt(np.sum(power * excitation.T[:, None, :] ** 2, axis=(0, 2)))
