"""Errors of transmissions: waves in the position of a joint, and ratios other than declared."""

from __future__ import annotations

from collections.abc import Sequence

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
        turned = _waves(model, q)
        error += (waves[:, :, 0] * np.imag(turned) + waves[:, :, 1] * np.real(turned)).sum(axis=2)
    for joint, other in np.argwhere(ratios):
        error[:, joint] += ratios[joint, other] * _driving(model, q, joint, other)
    return error


def transmission_columns(model: RobotModel, q: np.ndarray, twists: Sequence[tuple[int, str]]) -> np.ndarray:
    """Derivatives (samples, T) of joints' transmission errors by waves or ratios: joint and key of the parameter of each of T."""
    result, waves = np.empty((len(q), len(twists))), None
    for k, (joint, key) in enumerate(twists):
        if key.startswith(RATIO):
            result[:, k] = _driving(model, q, joint, model.joint_index(key.removeprefix(RATIO)))
            continue
        waves = _waves(model, q) if waves is None else waves
        order, wave = key.split("_")[1:]
        own = waves[:, joint, model.drives.harmonics.index(int(order))]
        result[:, k] = np.imag(own) if wave == "sin" else np.real(own)
    return result


def transmission_slopes(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Derivative (samples, N, n) of what the motors move every joint's own coordinate by, transmission errors included."""
    waves, ratios = model.drives.transmission, model.drives.ratio_error
    own = np.broadcast_to(motor_motion(model), (len(q), len(model.joints), model.n)).copy()
    if waves.any():
        orders = np.array(model.drives.harmonics)
        turned, (sine, cosine) = _waves(model, q), np.moveaxis(orders[:, None] * waves, 2, 0)
        own *= 1 + (sine * np.real(turned) - cosine * np.imag(turned)).sum(axis=2)[:, :, None]
    every = motor_motion(model) if model.relations is None else model.relations.carry @ motor_motion(model)
    for joint, other in np.argwhere(ratios):
        own[:, joint] += ratios[joint, other] * (motor_motion(model) if joint == other else every)[other]
    return own


def _waves(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Waves e^{i k θ} (samples, N, harmonics) of every order k in the joints' positions θ at the motors' `q` (samples, n)."""
    powers = [np.exp(1j * joint_positions(model, q))]
    while len(powers) < max(model.drives.harmonics):
        powers.append(powers[0] * powers[-1])
    return np.stack([powers[order - 1] for order in model.drives.harmonics], axis=2)


def _driving(model: RobotModel, q: np.ndarray, joint: int, other: int) -> np.ndarray:
    """Position (samples,) of what moves a joint: of another joint, or, for `other` the same, of its own motor."""
    return q @ motor_motion(model)[joint] if joint == other else joint_positions(model, q)[:, other]
