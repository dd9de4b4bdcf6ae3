"""Profile likelihood of some parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.estimation.estimate import Estimate
from flexcal.estimation.levenberg_marquardt import minimise
from flexcal.estimation.loss import Squares
from flexcal.estimation.objective import Objective
from flexcal.estimation.problem import Problem


def profile_cost_increase(
    problem: Problem, fitted: Estimate, x: np.ndarray, fixed: Sequence[int], *, tolerance: float = 1e-6
) -> float:
    """Rise of the cost above that of `fitted` where the parameters `fixed` stay as in `x` (p,) and the others are fitted from there.

    Twice the rise is χ² with as many degrees of freedom as are held, at their true values (Wilks 1938).
    At a relative offset of `tolerance` the cost of n residuals of unit variance is n `tolerance`² / 2 above the minimum.
    Raises FlexcalError where the model cannot be evaluated at `x`.
    """
    objective = Objective.of(problem, Squares(), problem.linearise(x)[0].size)
    free = ~np.isin(np.arange(len(x)), fixed)
    return minimise(objective, x, free, max_iterations=50, tolerance=tolerance).cost - fitted.cost
