"""Whether positions tell torques: the effect of a common factor of all that acts on a joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.actuators.servo_simulation import ServoSimulation, Windows
from flexcal.export import Actuators

_FACTOR = 0.05
"""Relative change of the torques."""
_LEAST = 0.004
"""Effect of a factor e, relative to the tracking error, below which it is none: a quarter of it is then what time steps and the softness
of simulated friction change too."""


def torques_without_effect(
    simulation: ServoSimulation, found: Actuators, parts: Sequence[Windows], tracking: np.ndarray
) -> np.ndarray:
    """For each joint (n,) whether its gains, friction and total inertia could all have another factor; `tracking` (n,) rad or m rms.

    They could where neither gravity nor another joint nor a change of the inertia acts on it: the links' own part of the inertia is the
    only torque of known size then, and the armature makes up for it.
    """
    inertia = simulation.links + found.armature
    parts = [part for part in parts if len(part)]
    before = [simulation.positions(found, part, coarse=True) for part in parts]
    answers = []
    for i in range(len(tracking)):
        scaled = {key: getattr(found, key).copy() for key in Actuators.KEYS}
        for key in ("stiffness", "damping", "viscous", "coulomb"):
            scaled[key][i] *= 1.0 + _FACTOR
        scaled["armature"][i] += _FACTOR * inertia[i]
        changed = replace(found, **scaled)
        squares = [
            np.mean((simulation.positions(changed, part, coarse=True) - b)[:, :, i] ** 2)
            for part, b in zip(parts, before, strict=True)
        ]
        answers.append(bool(np.sqrt(np.mean(squares)) < _LEAST * _FACTOR * tracking[i]))
    return np.array(answers)
