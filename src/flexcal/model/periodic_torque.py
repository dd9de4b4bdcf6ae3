"""Torques of a robot whose motors move, its springs loaded by gravity and by the motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexcal.model.elastic_arm import ElasticArm
from flexcal.model.equilibrium import elastic_axes
from flexcal.model.robot_model import RobotModel


def periodic_torque(
    model: RobotModel,
    q: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    period: float,
    payload: float | None = None,
) -> np.ndarray:
    """Torque (N, n), N m, at each motor for the arm beyond it, at N even samples of one `period` (s) of a motion of the motors.

    As `yielding_torque`, with exact derivatives.
    """
    omega = 2j * np.pi / period * np.arange(len(q) // 2 + 1)[:, None]

    def derivatives(bent: np.ndarray) -> np.ndarray:
        lines = np.fft.rfft(bent, axis=0)
        return np.array([np.fft.irfft(lines * omega**order, n=len(q), axis=0) for order in range(3)])

    return yielding_torque(model, q, dq, ddq, derivatives, payload)


def yielding_torque(
    model: RobotModel,
    q: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    derivatives: Callable[[np.ndarray], np.ndarray],
    payload: float | None = None,
    passes: int = 2,
) -> np.ndarray:
    """Torque (N, n), N m, at each motor for the arm beyond it, at N samples of a motion of the motors.

    `q`, `dq`, `ddq` (N, n) are the motors', referred to the joint; `derivatives` gives deflections (N, d) with their first and second
    derivative by time (3, N, d). Every spring yields to the torque that acts in it at that instant: right for motions well below the
    first resonance, where dampers do nothing. Gaps count as closed; rotors and friction are not in it. `payload` in kg, None for the
    declared. Of the evaluations (`passes`) the first is with a rigid arm, and each makes the deflections of the next right to another
    order of load over stiffness.
    """
    import pinocchio as pin

    arm = ElasticArm(model, payload)
    axes = elastic_axes(model)
    stiffness = np.array([model.stiffness[axis] for axis in axes])
    state = np.zeros((3, len(q), arm.model.nv))
    state[:, :, arm.joint_velocity] = q + model.geometry[:, 0], dq, ddq
    rigid = state.copy()
    torque = np.empty((len(q), arm.model.nv))
    for last in (*(False,) * (passes - 1), True):
        for k, (position, velocity, acceleration) in enumerate(state.transpose(1, 0, 2)):
            torque[k] = pin.rnea(arm.model, arm.data, position, velocity, acceleration)
        if last or not axes:
            break
        state = rigid.copy()
        state[:, :, arm.elastic] += derivatives(-torque[:, arm.elastic] / stiffness)
    return torque[:, arm.joint_velocity]
