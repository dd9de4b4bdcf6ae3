"""Noise of the torques of a loaded robot, from the residual of its fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.dynamics.payload.equations import PayloadEquations
from flexcal.errors import FlexcalError

_FIRST = 0.01
"""Initial noise, relative to the torques."""


def first_noise(equations: PayloadEquations) -> list[float]:
    """Initial standard deviations, N m, one per joint and recording."""
    return [
        s.floored(_FIRST * float(np.linalg.norm(s.triangle.right)) / np.sqrt(s.triangle.rows))
        for s in equations.data.subsystems
    ]


def residual_noise(
    equations: PayloadEquations, noise: Sequence[float], values: np.ndarray, root: np.ndarray
) -> list[float]:
    """Standard deviations, N m, one per joint and recording, from the residuals at `values` (u,) and their degrees of freedom.

    `root` (u, k) has root rootᵀ = the covariance by the `noise` before. Raises `FlexcalError` where hardly more rows are left than they
    determine unknowns.
    """
    n, missed, levels = equations.data.observation.model.n, np.append(-values, 1.0), []
    for number, s in enumerate(equations.data.subsystems):
        experiment, joint = divmod(number, n)
        rows = np.vstack([batch.factors[joint] for batch in equations.batches[experiment]])
        taken = float(np.sum((rows[:, :-1] @ root / noise[number]) ** 2))
        freedom = s.triangle.rows - taken
        if freedom <= 2.0:
            raise FlexcalError(
                "E-DYN-023",
                f"{s.triangle.rows} equations of {equations.data.observation.labels[joint]} in recording {experiment + 1} do not determine "
                "its noise; record for longer, or decimate less.",
            )
        levels.append(s.floored(float(np.linalg.norm(rows @ missed)) / np.sqrt(freedom)))
    return levels
