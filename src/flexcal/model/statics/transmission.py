"""Errors of transmissions: waves in the position of a joint, and ratios other than declared."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics import joint_positions, motor_motion
from flexcal.model.robot import RATIO, RobotModel


def transmission_error(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Transmission error (samples, N), rad or m, at the motors' `q` (samples, n): Σ a_k sin(k θ) + b_k cos(k θ) + Σ r_j θ_j.

    The ratio errors r are of the joints j that a joint follows, and of a slide's own motor.
    """
    waves, ratios = model.drives.transmission, model.drives.ratio_error
    error = np.zeros((len(q), len(model.joints)))
    if waves.any():
        phase = joint_positions(model, q)[:, :, None] * np.array(model.drives.harmonics)
        error += (waves[:, :, 0] * np.sin(phase) + waves[:, :, 1] * np.cos(phase)).sum(axis=2)
    for joint, other in np.argwhere(ratios):
        error[:, joint] += ratios[joint, other] * _driving(model, q, joint, other)
    return error


def transmission_column(model: RobotModel, q: np.ndarray, joint: int, key: str) -> np.ndarray:
    """Derivative (samples,) of a joint's transmission error by a wave or a ratio, `key` being that of its parameter."""
    if key.startswith(RATIO):
        return _driving(model, q, joint, model.joint_index(key.removeprefix(RATIO)))
    order, wave = key.split("_")[1:]
    phase = int(order) * joint_positions(model, q)[:, joint]
    return np.sin(phase) if wave == "sin" else np.cos(phase)


def transmission_slopes(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Derivative (samples, N, n) of what the motors move every joint's own coordinate by, transmission errors included."""
    waves, ratios = model.drives.transmission, model.drives.ratio_error
    own = np.broadcast_to(motor_motion(model), (len(q), len(model.joints), model.n)).copy()
    if waves.any():
        orders = np.array(model.drives.harmonics)
        phase = joint_positions(model, q)[:, :, None] * orders
        sine, cosine = np.moveaxis(orders[:, None] * waves, 2, 0)
        own *= 1 + (sine * np.cos(phase) - cosine * np.sin(phase)).sum(axis=2)[:, :, None]
    every = motor_motion(model) if model.relations is None else model.relations.carry @ motor_motion(model)
    for joint, other in np.argwhere(ratios):
        own[:, joint] += ratios[joint, other] * (motor_motion(model) if joint == other else every)[other]
    return own


def _driving(model: RobotModel, q: np.ndarray, joint: int, other: int) -> np.ndarray:
    """Position (samples,) of what moves a joint: of another joint, or, for `other` the same, of its own motor."""
    return q @ motor_motion(model)[joint] if joint == other else joint_positions(model, q)[:, other]
