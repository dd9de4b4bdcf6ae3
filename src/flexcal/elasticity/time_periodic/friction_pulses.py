"""Effect of Coulomb friction at the reversals of the reference motion on the frequency response.

Friction acts on the small motion only around the reversals of the slow one, as a pulse of strong damping twice a cycle. The mean of the
pulses is part of the motor's viscous coefficient in that pose; their change over the cycle couples the excited line with sidebands at
even multiples of the reference frequency, where the robot answers with its own resonances.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexcal.elasticity.time_periodic.reference_motion import ReferenceMotion
from flexcal.elasticity.time_periodic.sidebands import Sidebands
from flexcal.model.vibration import Linearisation

SIDEBANDS = 16
"""Number of even multiples of the reference frequency balanced on either side of the excited line."""

WIDTH_PASSES = 3
"""Number of passes in which the width of the pulses is updated by the motion that they damp."""


@dataclass(frozen=True, eq=False)
class FrictionPulses:
    """Pulsed friction in one pose: the Gaussian equivalent of Coulomb's law.

    `strength` (E,) N m s/rad is the part of each motor's viscous coefficient that friction makes. The derivative of friction by the
    velocity is a delta function at rest; under a multisine of the velocity v (standard deviation at the reversals) on top of
    A Ω cos Ωt it becomes two Gaussian pulses a cycle, of the width σ = v / (A Ω²) in s, `width` (E,), and the Fourier coefficients
    (-1)^(m/2) exp(-(m Ω σ)²/2) for even orders m. `mobility` (L, k, E, E) rad/s per N m is that of the motors, `sensed` (L, S, E) what
    sensors on the arm read at the line per N m, in the closed loop.
    """

    sidebands: Sidebands
    omega: float
    mobility: np.ndarray
    sensed: np.ndarray
    strength: np.ndarray
    width: np.ndarray

    @classmethod
    def of(
        cls, system: Linearisation, frequencies_hz: np.ndarray, motion: ReferenceMotion, strength: np.ndarray
    ) -> FrictionPulses:
        """Pulses for lines (L,) Hz of a system whose viscous coefficients include `strength`."""
        count = system.inputs
        omega = 2 * np.pi * motion.frequency_hz
        orders = 2 * np.arange(-SIDEBANDS, SIDEBANDS + 1)
        bands = Sidebands.of(system, frequencies_hz, motion, orders)
        moved = bands.response(np.eye(len(system.mass), count))
        mobility = bands.s[:, :, None, None] * moved[:, :, :count]
        sensed = np.zeros((len(mobility), 0, count))
        if system.sensed is not None:
            sensed = system.sensed.at(bands.s[:, bands.middle]) @ moved[:, bands.middle]
        pulses = cls(bands, omega, mobility, sensed, strength, np.zeros(count))
        velocity = np.where((orders == 0)[:, None, None], mobility, 0.0)
        for _ in range(WIDTH_PASSES):
            speed = _reversal_velocity(velocity, orders, motion.excitation)
            pulses = replace(pulses, width=speed / (motion.amplitude * omega**2))
            velocity = pulses.velocity
        return pulses

    def coefficients(self) -> np.ndarray:
        """Coefficients, N m s/rad (k, l, E), of the torque at order k due to the velocity at order l, the mean excluded."""
        orders = self.sidebands.orders
        apart = orders[:, None] - orders[None, :]
        decay = np.exp(-0.5 * (apart[:, :, None] * self.omega * self.width) ** 2)
        sign = np.where(apart == 0, 0.0, np.where(apart % 4 == 0, 1.0, -1.0))
        return sign[:, :, None] * decay * self.strength

    @cached_property
    def velocity(self) -> np.ndarray:
        """Motor velocities (L, k, E, E) of all orders per N m at the line: v = Y (τ - F v)."""
        lines, orders, count, _ = self.mobility.shape
        size = orders * count
        coupled = self.mobility[:, :, :, None] * self.coefficients()[:, None]  # (L, k, i, l, j)
        system = coupled.reshape(lines, size, size)
        system[:, range(size), range(size)] += 1.0
        driven = np.zeros_like(self.mobility)
        driven[:, orders // 2] = self.mobility[:, orders // 2]
        moved = np.linalg.solve(system, driven.reshape(lines, -1, count))
        return moved.reshape(self.mobility.shape)

    @cached_property
    def shift(self) -> np.ndarray:
        """G with pulsed friction less G with its mean, (L, E + S, E): rad/s² per N m, then the sensors' readings."""
        bands = self.sidebands
        pulsed, mean = (bands.measured_mobility(v[:, bands.middle]) for v in (self.velocity, self.mobility))
        return self._readings @ (pulsed - mean)

    def shift_by_form(self) -> np.ndarray:
        """∂ `shift` (L, E + S, E, 2 E) by the logarithm of every strength, then of every width.

        The velocities at the line change by -vᵀ ∂F v, with those v at all orders: v = (Y⁻¹ + F)⁻¹ τ, and Y and F are symmetric.
        """
        bands, velocity = self.sidebands, self.velocity
        by_strength = self.coefficients()
        apart = (bands.orders[:, None] - bands.orders[None, :])[:, :, None]
        by_width = -((apart * self.omega * self.width) ** 2) * by_strength
        moved = velocity.transpose(2, 0, 1, 3)  # (j, L, k, E)
        changes = [
            -np.swapaxes(of_motor, 1, 2) @ (form[:, :, j] @ of_motor)
            for form in (by_strength, by_width)
            for j, of_motor in enumerate(moved)
        ]
        pulsed = velocity[:, bands.middle]
        share = bands.measured_mobility(pulsed) @ np.linalg.inv(pulsed)
        readings = self._readings @ share
        return np.stack([readings @ change @ np.swapaxes(share, 1, 2) for change in changes], axis=-1)

    @property
    def _readings(self) -> np.ndarray:
        """Accelerations and sensors' readings (L, E + S, E) per motor velocity at the line, rad/s; the readings follow the forces there,
        the torque less friction.
        """
        middle, count = self.sidebands.middle, self.mobility.shape[2]
        acceleration = self.sidebands.s[:, middle, None, None] * np.eye(count)
        return np.concatenate([acceleration, self.sensed @ np.linalg.inv(self.mobility[:, middle])], axis=1)


def _reversal_velocity(moved: np.ndarray, orders: np.ndarray, excitation: np.ndarray) -> np.ndarray:
    """Standard deviation (E,) rad/s of the motors' fast motion at Ωt = ±π/2, from velocities (L, k, E, E) per N m."""
    turn = np.where(orders % 4 == 0, 1.0, -1.0)
    power = np.abs(np.einsum("k,Lkij->Lij", turn, moved)) ** 2
    return np.sqrt(0.5 * np.einsum("Lij,jL->i", power, excitation**2))
