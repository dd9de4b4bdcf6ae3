"""Noise spectrum of residuals, line by line."""

from __future__ import annotations

import numpy as np

from flexcal.dynamics.trajectory_rows import TrajectoryRows
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate

_REACH = 6
"""Neighbouring lines on either side that the noise of a line is read from."""
_CORNERS = (1.0, 2.0, 4.0, 8.0, np.inf)
"""Lines at which a first-order spectrum has fallen by half, among which the residual chooses; the last is white."""
_SMALLEST = 1e-9
"""Noise of torques that are fitted exactly, relative to them."""


def noise(rows: TrajectoryRows, estimate: Estimate, weighed: np.ndarray) -> np.ndarray:
    """Standard deviation (2 K + 1, n) of every coefficient of every joint, N m, smooth over the lines.

    From the residual of an estimate that was weighed with `weighed` (2 K + 1, n), less the freedom that it took from there. About every
    line the spectrum is first-order with an unknown level and corner, so that the level at zero is not that of the lines above, on one
    side of it. The variance is its posterior mean, ν / (ν - 2) times the usual one for ν degrees of freedom: with it the
    normal quantile holds what Student's t should (95 % for ν from 3 on). Raises `FlexcalError` where no two degrees are left.
    """
    step = estimate.parameters.coordinates() - rows.parameters.coordinates()
    squares = np.sum((rows.residual - rows.jacobian @ step) ** 2, axis=0)
    white = rows.jacobian / weighed[:, :, None]
    taken = np.einsum("tkjp,pr,tkjr->tkj", white, estimate.covariance, white, optimize=True)
    free = np.sum(1.0 - taken, axis=0)
    near = np.abs(rows.lines[:, None] - rows.lines) <= _REACH
    freedom = near @ free
    if freedom.min() <= 2.0:
        raise FlexcalError(
            "the recordings leave too few lines to estimate their noise; record more or longer trajectories."
        )
    shapes = 1.0 / (1.0 + (rows.lines / np.array(_CORNERS)[:, None]) ** 2)[:, :, None]
    sums = np.maximum(near @ (squares / shapes), (_SMALLEST * rows.size) ** 2)
    evidence = -0.5 * (near @ (free * np.log(shapes)) + freedom * np.log(sums))
    share = np.exp(evidence - evidence.max(axis=0))
    return np.sqrt(np.sum(share * shapes * sums, axis=0) / share.sum(axis=0) / (freedom - 2.0))
