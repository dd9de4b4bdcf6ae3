"""The noise of the rows, band by band of the spectrum: what an autocorrelated residual is in the frequency domain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.trajectory_rows import TrajectoryRows
from flexcal.estimation import Estimate

_LINES = 10
"""Lines of one band."""


@dataclass(frozen=True, eq=False)
class NoiseBands:
    """`sigma` (2 K + 1, n): standard deviation of every coefficient of every joint, N m, constant over a band."""

    sigma: np.ndarray

    @classmethod
    def of(cls, rows: TrajectoryRows, estimate: Estimate, weighed: np.ndarray) -> NoiseBands:
        """From the residual of an estimate that was weighed with `weighed` (2 K + 1, n), less the freedom it took from each band."""
        x, about = estimate.parameters.coordinates(), rows.parameters.coordinates()
        squares = np.sum((rows.residual - rows.jacobian @ (x - about)) ** 2, axis=0)
        white = rows.jacobian / weighed[:, :, None]
        free = np.sum(
            1.0 - np.einsum("tkjp,pr,tkjr->tkj", white, estimate.covariance, white, optimize=True), axis=0
        )
        band = (rows.lines - (rows.lines > 0)) // _LINES
        sigma = np.empty_like(squares)
        for number in np.unique(band):
            at = band == number
            sigma[at] = np.sqrt(squares[at].sum(axis=0) / free[at].sum(axis=0))
        return cls(sigma)
