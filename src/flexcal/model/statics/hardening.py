"""Hardening drive springs, as of gears whose teeth come into contact in succession: a twist θ takes the torque k θ (1 + h (θ / 1 mrad)²).

The hardening h is the share by which the torque at a twist of 1 mrad, about that of a loaded gear, exceeds what the stiffness k at no load
makes of it.
"""

from __future__ import annotations

import numpy as np

REFERENCE_TWIST = 1e-3
"""Twist, rad, to which hardening refers."""
_NEWTON_STEPS = 20


def twist_from_torque(torque: np.ndarray, stiffness: np.ndarray, hardening: np.ndarray) -> np.ndarray:
    """Twist (..., n), rad, under `torque` (..., n) N m; `stiffness` (n,) N m/rad at no load, `hardening` (n,) at least 0."""
    linear = torque / stiffness
    if not np.any(hardening):
        return linear
    twist = linear / (1 + hardening * (linear / REFERENCE_TWIST) ** 2) ** (1 / 3)
    for _ in range(_NEWTON_STEPS):
        excess = twist * (1 + hardening * (twist / REFERENCE_TWIST) ** 2) - linear
        step = excess / tangent_ratio(twist, hardening)
        twist = twist - step
        if np.all(np.abs(step) <= 1e-15):
            break
    return twist


def tangent_ratio(twist: np.ndarray, hardening: np.ndarray) -> np.ndarray:
    """Ratio of the tangent stiffness at a twist to that at no load."""
    return 1 + 3 * hardening * (twist / REFERENCE_TWIST) ** 2


def twist_by_hardening(twist: np.ndarray, hardening: np.ndarray) -> np.ndarray:
    """Derivative, rad, of the twist under a given torque with respect to hardening."""
    return -twist * (twist / REFERENCE_TWIST) ** 2 / tangent_ratio(twist, hardening)
