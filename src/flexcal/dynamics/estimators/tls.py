"""Mixed total least squares: some columns with errors, others exact (Van Huffel & Vandewalle 1991)."""

from __future__ import annotations

import numpy as np

from flexcal.dynamics.estimators.linear_least_squares import Unknowns, weighted_system
from flexcal.dynamics.estimators.wls import noise_levels, weighted_least_squares
from flexcal.dynamics.regression import RegressionData, Subsystem, batch_covariance
from flexcal.estimation import Estimate

_LEAST_TORQUE_NOISE = 1e-2
"""Least share of the torque noise in the variance of a residual."""


def total_least_squares(data: RegressionData, errors: RegressionData) -> Estimate:
    """Estimate χ̂ minimising ‖A x‖ / ‖B x‖ over x = [χ, −1], with A = [W, Y] and B the errors of the columns of A, all by `noise_levels`.

    `errors` has for the same subsystems what the position noise makes of W (rows ΔW of it, not of one recording's own errors: of
    any with the same covariance), zero in the columns that are exact, so that sign and constant columns stay as they are. What the residual
    of `weighted_least_squares` has beyond ΔW χ is the noise of the torque. The minimum is one singular vector of B A⁻¹, from the R
    factors of both. Errors of W bend least squares towards zero; where they are small, both agree. The covariance is that of the
    weighted rows, times what the subtracted errors amplify. Raises `FlexcalError` as `weighted_least_squares` does.
    """
    from scipy.linalg import solve_triangular

    noise = noise_levels(data)
    first = weighted_least_squares(data).parameters.coordinates()
    system, wrong = weighted_system(data, noise), weighted_system(errors, noise)
    unknowns = Unknowns.of(data, system)
    kept, start = unknowns.kept, data.observation.values()
    factor, scale = unknowns.reduced(system)
    # an exact fit leaves A singular
    factor[-1, -1] = max(abs(factor[-1, -1]), np.finfo(float).eps * np.linalg.norm(factor[:, -1]))
    torque = sum(
        _torque_share(s, e, sigma, first) * s.triangle.rows
        for s, e, sigma in zip(data.subsystems, errors.subsystems, noise, strict=True)
    )
    spoilt = np.zeros((len(wrong.factor) + 1, len(kept) + 1))
    spoilt[:-1, :-1] = wrong.matrix[:, kept] * scale
    spoilt[:-1, -1] = -wrong.matrix @ start
    spoilt[-1, -1] = np.sqrt(torque)
    values, directions = np.linalg.svd(solve_triangular(factor, spoilt.T, trans=1).T)[1:]
    level = 1.0 / values[0] ** 2
    along = np.linalg.solve(factor, directions[0])
    parameters = start.copy()
    parameters[kept] -= scale * along[:-1] / along[-1]
    cost = float(np.linalg.norm(system.right - system.matrix @ parameters) ** 2)
    freedom = unknowns.freedom(system)
    triangle, errors_seen = factor[:-1, :-1], spoilt[:-1, :-1]
    root = scale[:, None] * np.linalg.solve(triangle, np.eye(len(kept)))
    uncertainty = batch_covariance(data, noise, parameters, kept, root, cost / freedom)
    seen = triangle.T @ triangle
    more = np.linalg.solve(seen - level * errors_seen.T @ errors_seen, seen) * scale[:, None] / scale
    covariance = more @ uncertainty.covariance @ more.T
    message = f"total least squares; the errors are {np.sqrt(level):.3g} times as large as those of position and torque noise"
    return unknowns.estimate(parameters, covariance, uncertainty.freedom, cost, freedom, message)


def _torque_share(own: Subsystem, wrong: Subsystem, sigma: float, parameters: np.ndarray) -> float:
    """Share of the variance of a subsystem's residual that is not due to ΔW χ."""
    moved = float(np.linalg.norm(wrong.triangle.matrix @ parameters[wrong.column_indices])) / sigma
    return max(1.0 - moved**2 / own.triangle.rows, _LEAST_TORQUE_NOISE)
