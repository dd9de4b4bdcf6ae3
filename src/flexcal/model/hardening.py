"""Drive springs that harden: the torque k (θ + a θ³) of a twist θ, as of gears whose teeth come into contact one after the other."""

from __future__ import annotations

import numpy as np

_NEWTON_STEPS = 20


def twist_of(torque: np.ndarray, stiffness: np.ndarray, hardening: np.ndarray) -> np.ndarray:
    """Twist (..., n), rad, under `torque` (..., n) N m; `stiffness` k (n,) N m/rad at no load, `hardening` a ≥ 0 (n,) 1/rad²."""
    linear = torque / stiffness
    if not np.any(hardening):
        return linear
    twist = linear / (1 + hardening * linear**2) ** (1 / 3)
    for _ in range(_NEWTON_STEPS):
        step = (twist + hardening * twist**3 - linear) / tangent_ratio(twist, hardening)
        twist = twist - step
        if np.all(np.abs(step) <= 1e-15):
            break
    return twist


def tangent_ratio(twist: np.ndarray, hardening: np.ndarray) -> np.ndarray:
    """Tangent stiffness at a twist over that at no load, 1 + 3 a θ²."""
    return 1 + 3 * hardening * twist**2


def twist_by_hardening(twist: np.ndarray, hardening: np.ndarray) -> np.ndarray:
    """Derivative of the twist under a given torque by the hardening, rad³."""
    return -(twist**3) / tangent_ratio(twist, hardening)
