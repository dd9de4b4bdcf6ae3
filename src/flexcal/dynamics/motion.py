"""A recording as the identification of dynamics needs it: filtered positions, velocities, accelerations, torques."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data import Recording
from flexcal.data.filtering import central_difference, low_pass

_BORDER_PERIODS = 1.0
"""What is cut from either end, in periods of the cut-off."""


@dataclass(frozen=True, eq=False)
class Motion:
    """`q`, `dq`, `ddq` (N, n) in rad, m and s, the motor `torque` (N, n) referred to the joint, at `time` (N,), s."""

    time: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    torque: np.ndarray

    def __len__(self) -> int:
        return len(self.time)

    def part(self, start: int, stop: int) -> Motion:
        """Samples from `start` to before `stop`."""
        at = slice(start, stop)
        return Motion(self.time[at], self.q[at], self.dq[at], self.ddq[at], self.torque[at])

    @classmethod
    def of(cls, recording: Recording, cutoff_hz: float) -> Motion:
        """Positions through a zero-phase low-pass, differentiated by central differences; the torque as measured.

        Samples nearer to an end than one period of the cut-off are removed. Raises `FlexcalError` as `low_pass` does.
        """
        step = recording.time_step
        q = low_pass(recording.q, step, cutoff_hz)
        dq = central_difference(q, step)
        ddq = central_difference(dq, step)
        border = int(np.ceil(_BORDER_PERIODS / (cutoff_hz * step)))
        whole = cls(recording.time, q, dq, ddq, recording.torque)
        return whole.part(border, len(whole) - border)
