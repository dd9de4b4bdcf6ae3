"""Random Fourier trajectories that keep all limits, of which the best is what an optimiser has to beat (Swevers 1997)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexcal.design.scene import CollisionChecker
from flexcal.model.kinematics import joint_ranges
from flexcal.model.robot import RobotModel
from flexcal.model.torques import inertial_parameters, torque_regressor

INSTANTS = 200
SHARE = 0.95
"""Largest use of range, velocity and torque at the instants looked at, so that between them the limits hold, too."""


def random_trajectories(
    model: RobotModel, duration: float, harmonics: int, rng: np.random.Generator
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Centres (n,) and complex amplitudes (H, n) of positions, feasible ones only, without end."""
    checker = CollisionChecker(model)
    lower, upper = joint_ranges(model)
    velocity, effort = np.array([(joint.velocity, joint.effort) for joint in model.joints]).T
    inertial = inertial_parameters(model)
    time = np.arange(INSTANTS) * duration / INSTANTS
    multiple = np.arange(1, harmonics + 1)[:, None]
    while True:
        drawn = rng.standard_normal((2, harmonics, model.n))
        amplitude = (drawn[0] + 1j * drawn[1]) / multiple
        q, dq, _ = fourier_motion(np.zeros(model.n), amplitude, duration, time)
        allowed = SHARE * np.minimum((upper - lower) / np.ptp(q, axis=0), velocity / np.abs(dq).max(axis=0))
        amplitude = allowed * rng.uniform(0.3, 1.0, model.n) * amplitude
        q, _, _ = fourier_motion(np.zeros(model.n), amplitude, duration, time)
        centre = rng.uniform(lower - q.min(axis=0), upper - q.max(axis=0))
        q, dq, ddq = fourier_motion(centre, amplitude, duration, time)
        torque = torque_regressor(model, q, dq, ddq) @ inertial
        if (np.abs(torque) <= SHARE * effort).all() and not checker.collides(q).any():
            yield centre, amplitude


def fourier_motion(
    centre: np.ndarray, amplitude: np.ndarray, duration: float, time: np.ndarray
) -> np.ndarray:
    """q, q̇, q̈ (3, N, n) of the real part of amplitudes (H, n) turning once, twice … over the duration, about the centre (n,)."""
    omega = 2j * np.pi / duration * np.arange(1, len(amplitude) + 1)
    turning = np.exp(time[:, None] * omega)
    q, dq, ddq = ((turning * omega**order @ amplitude).real for order in range(3))
    return np.array([q + centre, dq, ddq])
