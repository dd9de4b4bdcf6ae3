"""Iteration of simulation and estimation to a fixed point, from a physically consistent start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from flexcal.dynamics.estimators.feasible import feasible_least_squares
from flexcal.dynamics.regression import RegressionData
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate

_SETTLED = 0.05
"""Largest difference of estimated and simulated base parameters, in standard deviations, at convergence."""
_ROUNDING = 1e-9
"""Largest relative difference of estimated and simulated base parameters at convergence."""
_WHOLE = 4
"""Number of full steps, followed by half steps: friction that sticks in one simulation and slips in the next may cause oscillation."""
_ITERATIONS = 20


def simulated_iteration(data: RegressionData, step: Callable[[np.ndarray], Estimate], name: str) -> Estimate:
    """Estimate by `step` from the simulation with its own parameters (fixed point).

    It starts from that of `feasible_least_squares`, or from CAD where there is none. `step` gets parameters (p,) that move as the last
    estimate does, and whose links are bodies as far as no torque tells otherwise: what the base parameters leave open stays as it was
    at the start. Raises `FlexcalError` where the steps do not settle.
    """
    robot = _first(data)
    kept, regrouping = np.array(data.base.identifiability.kept), data.base.identifiability.regrouping
    for iteration in range(1, _ITERATIONS + 1):
        estimate = step(robot)
        moved = regrouping @ (estimate.parameters.coordinates() - robot)
        seen = np.array(estimate.identifiable)[kept]
        std = np.sqrt(np.diag(estimate.covariance))[kept]
        room = _SETTLED * std + _ROUNDING * np.abs(regrouping) @ np.abs(robot)
        if np.all((np.abs(moved) <= room)[seen]):
            return replace(estimate, iterations=iteration)
        robot[kept] += moved if iteration <= _WHOLE else 0.5 * moved
    raise FlexcalError(
        "E-DYN-011", f"{name} does not converge in {_ITERATIONS} simulations; use --estimator wls."
    )


def _first(data: RegressionData) -> np.ndarray:
    try:
        return feasible_least_squares(data).parameters.coordinates()
    except FlexcalError:
        return data.observation.values()
