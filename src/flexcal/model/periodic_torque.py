"""Torques of a robot whose motors move periodically, its springs loaded by gravity and by the motion."""

from __future__ import annotations

import numpy as np

from flexcal.model.elastic_arm import ElasticArm
from flexcal.model.equilibrium import elastic_axes
from flexcal.model.robot_model import RobotModel

_PASSES = 2
"""Evaluations: the first with a rigid arm; each makes the deflections of the next right to another order of load over stiffness."""


def periodic_torque(
    model: RobotModel,
    q: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    period: float,
    payload: float | None = None,
) -> np.ndarray:
    """Torque (N, n), N m, at each motor for the arm beyond it, at N even samples of one `period` (s) of a motion of the motors.

    `q`, `dq`, `ddq` (N, n) are the motors', referred to the joint. Every spring yields to the torque that acts in it at that
    instant: right for motions well below the first resonance, where dampers do nothing. Gaps count as closed; rotors and friction are not
    in it. `payload` in kg, None for the declared.
    """
    import pinocchio as pin

    arm = ElasticArm(model, payload)
    axes = elastic_axes(model)
    stiffness = np.array([model.stiffness[axis] for axis in axes])
    omega = 2j * np.pi / period * np.arange(len(q) // 2 + 1)[:, None]
    state = np.zeros((3, len(q), arm.model.nv))
    state[:, :, arm.joint_velocity] = q + model.geometry[:, 0], dq, ddq
    rigid = state.copy()
    torque = np.empty((len(q), arm.model.nv))
    for last in (*(False,) * (_PASSES - 1), True):
        for k, (position, velocity, acceleration) in enumerate(state.transpose(1, 0, 2)):
            torque[k] = pin.rnea(arm.model, arm.data, position, velocity, acceleration)
        if last or not axes:
            break
        yielded = np.fft.rfft(-torque[:, arm.elastic] / stiffness, axis=0)
        bent = [np.fft.irfft(yielded * omega**order, n=len(q), axis=0) for order in range(3)]
        state = rigid.copy()
        state[:, :, arm.elastic] += np.array(bent)
    return torque[:, arm.joint_velocity]
