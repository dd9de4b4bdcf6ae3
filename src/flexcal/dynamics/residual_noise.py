"""The noise of the rows by line: what the autocorrelation of a residual is in the frequency domain."""

from __future__ import annotations

import numpy as np

from flexcal.dynamics.trajectory_rows import TrajectoryRows
from flexcal.estimation import Estimate

_REACH = 3
"""Neighbouring lines on either side that the noise of a line is read from."""
_SMALLEST = 1e-9
"""Noise of torques that are fitted exactly, relative to them."""


def noise(rows: TrajectoryRows, estimate: Estimate, weighed: np.ndarray) -> np.ndarray:
    """Standard deviation (2 K + 1, n) of every coefficient of every joint, N m, smooth over the lines.

    From the residual of an estimate that was weighed with `weighed` (2 K + 1, n), less the freedom that it took from there.
    """
    step = estimate.parameters.coordinates() - rows.parameters.coordinates()
    squares = np.sum((rows.residual - rows.jacobian @ step) ** 2, axis=0)
    white = rows.jacobian / weighed[:, :, None]
    taken = np.einsum("tkjp,pr,tkjr->tkj", white, estimate.covariance, white, optimize=True)
    near = np.abs(rows.lines[:, None] - rows.lines) <= _REACH
    sigma = np.sqrt((near @ squares) / (near @ np.sum(1.0 - taken, axis=0)))
    return np.maximum(sigma, _SMALLEST * rows.size)
