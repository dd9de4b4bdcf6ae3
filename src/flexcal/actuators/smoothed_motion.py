"""Joint positions, velocities and accelerations from logged positions, by a local polynomial (Savitzky & Golay 1964)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.recordings import CommandLog

_SPAN = 0.05
"""Length of the polynomials, s; five samples at least."""
_ORDER = 3


@dataclass(frozen=True, eq=False)
class SmoothedMotion:
    """Smoothed positions, velocities and accelerations (N, n) of a log, its smoothed `command`, and the noise (n,) of the positions."""

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    command: np.ndarray
    noise: np.ndarray

    @classmethod
    def of(cls, log: CommandLog) -> SmoothedMotion:
        """Motion of a log."""
        from scipy.signal import savgol_filter

        length = max(2 * round(0.5 * _SPAN / log.time_step) + 1, 5)

        def smoothed(values: np.ndarray, derivative: int) -> np.ndarray:
            return np.asarray(
                savgol_filter(values, length, _ORDER, deriv=derivative, delta=log.time_step, axis=0)
            )

        q = smoothed(log.q, 0)
        share = 1.0 - float(savgol_filter(np.eye(1, length, length // 2)[0], length, _ORDER)[length // 2])
        return cls(
            q,
            smoothed(log.q, 1),
            smoothed(log.q, 2),
            smoothed(log.command, 0),
            np.sqrt(np.mean((log.q - q) ** 2, axis=0) / share),
        )
