"""Linearised robot at an excited line and its sidebands at multiples of the reference frequency, for harmonic balance (Wereley 1990)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.elasticity.time_periodic.reference_motion import ReferenceMotion
from flexcal.model.vibration import Linearisation


@dataclass(frozen=True, eq=False)
class Sidebands:
    """Response at lines (L,) and orders (k,) of the reference frequency Ω about each, position loop closed.

    `s` (L, k) is the Laplace variable, `dynamics` (L, k, d, d) is M s² + D s + K with the controller, whose impedance at the line itself is
    `loop` (L, E, E) N m s/rad.
    """

    orders: np.ndarray
    s: np.ndarray
    dynamics: np.ndarray
    loop: np.ndarray

    @classmethod
    def of(
        cls, system: Linearisation, frequencies_hz: np.ndarray, motion: ReferenceMotion, orders: np.ndarray
    ) -> Sidebands:
        """Sidebands of `orders` (k,), symmetric about 0."""
        motors = range(system.inputs)
        s = 2j * np.pi * (frequencies_hz[:, None] + orders * motion.frequency_hz)
        at = s[:, :, None, None]
        dynamics = at**2 * system.mass + at * system.damping + system.stiffness
        dynamics[:, :, motors, motors] += motion.kp + s[:, :, None] * motion.kd
        loop = np.zeros((len(s), system.inputs, system.inputs), dtype=complex)
        loop[:, motors, motors] = motion.kd + motion.kp / s[:, len(orders) // 2, None]
        return cls(orders, s, dynamics, loop)

    @property
    def middle(self) -> int:
        """Index of order 0."""
        return len(self.orders) // 2

    def response(self, forces: np.ndarray) -> np.ndarray:
        """Displacements (L, k, d, c) by `forces` (d, c) at every order."""
        return np.linalg.solve(self.dynamics, np.broadcast_to(forces, (*self.s.shape, *forces.shape)))

    def measured_mobility(self, velocity: np.ndarray) -> np.ndarray:
        """Motors' velocities (L, E, E) at the lines per measured torque, of which the controller's is part, from those per torque."""
        return np.linalg.inv(np.linalg.inv(velocity) - self.loop)
