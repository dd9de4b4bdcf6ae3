"""First values of actuator parameters, by least squares of the equation of motion at the logged samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.actuators.smoothed_motion import SmoothedMotion
from flexcal.data.recordings import CommandLog
from flexcal.export import Actuators, mjcf_spec
from flexcal.model.robot import RobotModel

LONGEST_DELAY = 0.15
"""s."""
_DELAYS = np.linspace(0.0, 0.1, 21)
_MOST_SAMPLES = 20_000
_BANDWIDTH, _RATIO = 2 * np.pi * 4.0, 0.8
"""Natural frequency, rad/s, and damping ratio of an axis whose equations give no stiffness."""
_SMALL = 0.02
"""Share of the torque that Coulomb friction and armature have at first where the equations give none."""


def start_values(
    model: RobotModel,
    logs: Sequence[CommandLog],
    motions: Sequence[SmoothedMotion],
    *,
    follows_velocity: bool,
    compensates_gravity: bool,
) -> tuple[Actuators, np.ndarray]:
    """Actuators by the equation error, and the links' inertias (n,) on the joints (medians).

    Joint by joint, τ(q, q̇, q̈) of the links = K (u(t − T) − q) + D v − f sgn q̇ − A q̈, with v = −q̇, or the velocity error where
    `follows_velocity`; no coefficient is negative (Lawson & Hanson 1974), and T is the best of a grid. A declared rotor inertia is the
    armature, and the rest in proportion, with which the motion is the same where gravity is small.
    """
    from scipy.optimize import nnls

    stride = max(sum(len(log) for log in logs) // _MOST_SAMPLES, 1)
    q, dq, ddq = (
        np.concatenate([getattr(motion, name)[::stride] for motion in motions]) for name in ("q", "dq", "ddq")
    )
    torque, inertia = _link_torques(model, q, dq, ddq, gravity=not compensates_gravity)
    found = {key: np.zeros(model.n) for key in Actuators.KEYS}
    for i in range(model.n):
        own = np.median(inertia[:, i])
        size = max(float(np.std(torque[:, i])), own * float(np.std(ddq[:, i])), 1e-9)
        best = np.inf
        for delay in _DELAYS:
            command, rate = (
                np.concatenate([value[::stride] for value in values])
                for values in zip(
                    *(_delayed(log, m, i, delay) for log, m in zip(logs, motions, strict=True)), strict=True
                )
            )
            velocity = rate - dq[:, i] if follows_velocity else -dq[:, i]
            friction = -np.tanh(dq[:, i] / (0.1 * np.std(dq[:, i]) + 1e-9))
            columns = np.stack([command - q[:, i], velocity, friction, -ddq[:, i]], axis=1)
            scale = np.linalg.norm(columns, axis=0)
            scale[scale == 0] = 1.0
            system = np.vstack([columns / scale, 1e-3 * np.eye(4)])
            solution, residual = nnls(system, np.concatenate([torque[:, i], np.zeros(4)]))
            if residual < best:
                best = residual
                solution = solution / scale
                found["delay"][i] = delay
                for key, value in zip(("stiffness", "damping", "coulomb", "armature"), solution, strict=True):
                    found[key][i] = value
        _complete(found, i, own, size)
        declared = float(model.drives.rotor_inertia[i])
        if np.isfinite(declared) and declared > 0:
            factor = (own + declared) / (own + found["armature"][i])
            for key in ("stiffness", "damping", "coulomb"):
                found[key][i] *= factor
            found["armature"][i] = declared
    actuators = Actuators(**found, follows_velocity=follows_velocity, compensates_gravity=compensates_gravity)
    return actuators, np.median(inertia, axis=0)


def _complete(found: dict[str, np.ndarray], i: int, inertia: float, torque: float) -> None:
    """Positive values where the equations of joint i gave none."""
    found["armature"][i] = max(found["armature"][i], _SMALL * inertia)
    moved = inertia + found["armature"][i]
    if found["stiffness"][i] <= 0:
        found["stiffness"][i] = moved * _BANDWIDTH**2
    if found["damping"][i] <= 0:
        found["damping"][i] = 2 * _RATIO * np.sqrt(found["stiffness"][i] * moved)
    found["coulomb"][i] = max(found["coulomb"][i], _SMALL * torque)


def _delayed(log: CommandLog, motion: SmoothedMotion, i: int, delay: float) -> tuple[np.ndarray, np.ndarray]:
    """Smoothed command (N,) of joint i, and its rate, both delayed."""
    time = log.time_step * np.arange(len(log))
    command = np.interp(time - delay, time, motion.command[:, i])
    return command, np.gradient(command, log.time_step)


def _link_torques(
    model: RobotModel, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, *, gravity: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Torques (N, n) that move the links alone, against gravity or not, and the diagonal (N, n) of their mass matrix."""
    import mujoco

    spec = mjcf_spec(model.without_springs())
    compiled = spec.compile()
    compiled.dof_armature[:] = 0.0
    if not gravity:
        compiled.opt.gravity[:] = 0.0
    data = mujoco.MjData(compiled)
    joints = [compiled.joint(name) for name in model.joint_names]
    positions = [joint.qposadr[0] for joint in joints]
    speeds = [joint.dofadr[0] for joint in joints]
    torque, inertia = np.zeros(q.shape), np.zeros(q.shape)
    result, mass = np.zeros(compiled.nv), np.zeros((compiled.nv, compiled.nv))
    for k in range(len(q)):
        data.qpos[positions], data.qvel[speeds], data.qacc[speeds] = q[k], dq[k], ddq[k]
        mujoco.mj_fwdPosition(compiled, data)
        mujoco.mj_fwdVelocity(compiled, data)
        mujoco.mj_rne(compiled, data, 1, result)
        torque[k] = result[speeds]
        mujoco.mj_fullM(compiled, data, mass)
        inertia[k] = np.diag(mass)[speeds]
    return torque, inertia
