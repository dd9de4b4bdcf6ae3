"""Fourier series of one period of a periodic experiment (Swevers 1997), for exact averaging, filtering and differentiation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.plans import TrajectoryPlan
from flexcal.data.recordings import Recording
from flexcal.errors import FlexcalError
from flexcal.frequency.periodic import torque_hold

_FOLLOWS, _FOLLOWS_SHARE = 0.1, 0.2
"""Distance from the planned motion, in rad or m and relative to its range, above which it is another motion: loops of weak gains lag."""


@dataclass(frozen=True, eq=False)
class PeriodicMotion:
    """Complex coefficients (K + 1, n) of `position` (rad) and `torque` (N m) at the multiples 0…K of `base_frequency_hz`."""

    position: np.ndarray
    torque: np.ndarray
    base_frequency_hz: float
    samples: int

    @classmethod
    def of(cls, recording: Recording, plan: TrajectoryPlan, number: int, cutoff_hz: float) -> PeriodicMotion:
        """Mean of the periods of trajectory `number` after the settling ones, up to `cutoff_hz`; the torque as applied, with its hold.

        What follows the last period, such as coming to rest, is left out. Raises `FlexcalError` where the recording is not as long or as
        fast as planned, or of another motion.
        """
        size, periods = plan.samples_per_period, plan.periods
        if len(recording) < size * periods or not np.isclose(
            recording.time_step * plan.rate_hz, 1.0, rtol=1e-6
        ):
            raise FlexcalError(
                "E-DYN-039",
                f"{recording.name} has {len(recording)} samples every {recording.time_step:g} s; its plan asks for {size * periods} every "
                f"{1 / plan.rate_hz:g} s.",
            )
        mean_q, mean_torque = (
            values[: size * periods].reshape(periods, size, -1)[plan.settle_periods :].mean(axis=0)
            for values in (recording.q, recording.torque)
        )
        planned = plan.motion(number, np.arange(size) / plan.rate_hz)[0]
        apart = np.abs(mean_q - planned).max(axis=0)
        allowed = np.maximum(_FOLLOWS, _FOLLOWS_SHARE * np.ptp(planned, axis=0))
        if (apart > allowed).any():
            joint = int(np.argmax(apart / allowed))
            raise FlexcalError(
                "E-DYN-040",
                f"{recording.name}: q{joint + 1} is up to {apart[joint]:.3g} from trajectory {number + 1} of its plan; record the planned "
                "trajectories in their order.",
            )
        lines = int(cutoff_hz / plan.base_frequency_hz) + 1
        omega = 2 * np.pi * plan.base_frequency_hz * np.arange(lines)

        position, torque = (np.fft.rfft(mean, axis=0)[:lines] / size for mean in (mean_q, mean_torque))
        torque = torque * torque_hold(plan, omega, recording.time_step)[:, None]
        return cls(position, torque, plan.base_frequency_hz, size)

    @property
    def lines(self) -> int:
        """Number of lines, zero frequency included."""
        return len(self.position)

    def states(self, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity and acceleration, each (samples, n), at even instants of the period."""
        omega = 2j * np.pi * self.base_frequency_hz * np.arange(self.lines)[:, None]
        wide = np.zeros((3, samples // 2 + 1, self.position.shape[1]), dtype=complex)
        for order in range(3):
            wide[order, : self.lines] = self.position * omega**order * samples
        q, dq, ddq = np.fft.irfft(wide, n=samples, axis=1)
        return q, dq, ddq

    def rows(self, values: np.ndarray) -> np.ndarray:
        """Real coefficients (2 K + 1, …) of `values` (samples, …) up to the cut-off: white noise stays white, and of one size."""
        return real_rows(np.fft.rfft(values, axis=0)[: self.lines] / len(values))


def real_rows(coefficients: np.ndarray) -> np.ndarray:
    """Real coefficients (2 K + 1, …) from complex ones (K + 1, …): the mean, then √2 times real and imaginary parts."""
    above = np.sqrt(2.0) * coefficients[1:]
    return np.concatenate([np.real(coefficients[:1]), np.real(above), np.imag(above)])
