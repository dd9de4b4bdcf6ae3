"""Motor torques of a robot with given motor motion, its springs loaded by gravity and inertia."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexcal.model.robot import RobotModel
from flexcal.model.statics import elastic_axes
from flexcal.model.vibration.elastic_arm import ElasticArm

_PASSES = 2
"""Number of evaluations of the torques, each with the deflections by the last."""


def periodic_torque(
    model: RobotModel,
    q: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    period: float,
    payload: float | None = None,
    like: ElasticArm | None = None,
) -> np.ndarray:
    """Torque (N, n), N m, at each motor for the arm beyond it, at N even samples of one `period` (s) of a motion of the motors.

    As `flexible_joint_torque`, with exact derivatives. `like` is the arm of a robot that may differ in its values alone: from it this
    one's is made faster.
    """
    omega = 2j * np.pi / period * np.arange(len(q) // 2 + 1)[:, None]

    def derivatives(bent: np.ndarray) -> np.ndarray:
        lines = np.fft.rfft(bent, axis=0)
        return np.array([np.fft.irfft(lines * omega**order, n=len(q), axis=0) for order in range(3)])

    arm = ElasticArm(model, payload) if like is None else like.with_inertials(model, payload)
    return _loads(model, arm, (q, dq, ddq), derivatives, _PASSES, None)[:, arm.joint_velocity]


def flexible_joint_torque(
    model: RobotModel,
    q: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    derivatives: Callable[[np.ndarray], np.ndarray],
    payload: float | None = None,
    passes: int = _PASSES,
    flanks: np.ndarray | None = None,
) -> np.ndarray:
    """Torque (N, n), N m, at each motor for the arm beyond it, at N samples of a motion of the motors.

    `q`, `dq`, `ddq` (N, n) are the motors', referred to the joint; `derivatives` gives deflections (N, d) with their first and second
    derivative by time (3, N, d). Every spring yields to the torque that acts in it at that instant, less what its damper takes: right for
    motions well below the first resonance. Rotors and friction are not in it. `payload` in kg, None for the declared. Of the evaluations
    (`passes`) the first is with a rigid arm, the second without dampers, and each makes the deflections of the next right to another
    order of load over stiffness. `flanks` (3, N, d), with both derivatives, say on which side of its gap a drive rests: -1 to 1, None
    for all gaps closed.
    """
    arm = ElasticArm(model, payload)
    return _loads(model, arm, (q, dq, ddq), derivatives, passes, flanks)[:, arm.joint_velocity]


def spring_load(
    model: RobotModel,
    q: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    derivatives: Callable[[np.ndarray], np.ndarray],
    payload: float | None = None,
) -> np.ndarray:
    """Torque (N, d), N m, of the arm on every spring, in the order of `elastic_axes`, gaps closed; arguments as of
    `flexible_joint_torque`.
    """
    arm = ElasticArm(model, payload)
    return -_loads(model, arm, (q, dq, ddq), derivatives, _PASSES, None)[:, arm.elastic]


def _loads(
    model: RobotModel,
    arm: ElasticArm,
    motion: tuple[np.ndarray, np.ndarray, np.ndarray],
    derivatives: Callable[[np.ndarray], np.ndarray],
    passes: int,
    flanks: np.ndarray | None,
) -> np.ndarray:
    """Torque (N, d + n) at every coordinate of the arm; arguments as of `flexible_joint_torque`."""
    import pinocchio as pin

    axes, count = elastic_axes(model), len(motion[0])
    stiffness, damping = (
        np.array([values[axis] for axis in axes])
        for values in (model.springs.stiffness, model.springs.damping)
    )
    half_backlash = np.array(
        [model.drives.backlash[joint] if component == 2 else 0.0 for joint, component in axes]
    )
    rigid = np.zeros((3, count, arm.model.nv))
    rigid[:, :, arm.joint_velocity] = motion[0] + model.geometry.errors[:, 0], motion[1], motion[2]
    state, torque, bent = rigid, np.empty(rigid.shape[1:]), np.zeros((3, count, len(axes)))
    for last in (*(False,) * (passes - 1), True):
        for k, (position, velocity, acceleration) in enumerate(state.transpose(1, 0, 2)):
            torque[k] = pin.rnea(arm.model, arm.data, position, velocity, acceleration)
        if last or not axes:
            break
        bent = derivatives(-(torque[:, arm.elastic] + damping * bent[1]) / stiffness)
        state = rigid.copy()
        state[:, :, arm.elastic] += bent if flanks is None else bent + half_backlash * flanks
    return torque
