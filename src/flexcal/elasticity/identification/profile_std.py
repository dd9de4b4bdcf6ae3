"""Standard deviation from the profile likelihood of a poorly determined stiffness (Raue et al. 2009)."""

from __future__ import annotations

import numpy as np

from flexcal.estimation import LOG_STD_LIMIT, Estimate, Problem, profile_cost_increase

WELL_KNOWN = 0.1
"""Posterior standard deviation of a log stiffness below which its double lies five standard deviations of the compliance away."""
_TOLERANCE = 1e-3
"""Relative offset of the fits, by which the rise of their cost is 0.01 too large with 20 000 rows."""


def profile_std_ratio(problem: Problem, fitted: Estimate, known: np.ndarray) -> np.ndarray:
    """Ratio (p,) of the width of the profile of the cost to its curvature, at least 1; `fitted` is the optimum of `problem`.

    A stiffness that counts as identifiable by its standard deviation `known` (p,) is held at twice its value and all others are fitted
    again. The response is nearly linear in the compliance, which is half there: where the cost rises by d, its relative standard deviation
    is 0.5/√(2 d). A soft and damped mode that follows the noise is found out so: giving it up costs little.
    """
    stretch = np.ones(len(fitted.parameters))
    x = fitted.parameters.coordinates()
    for number, (item, variance) in enumerate(
        zip(fitted.parameters, np.diag(fitted.covariance), strict=True)
    ):
        std = float(np.sqrt(variance))
        if not item.name.endswith(".stiffness") or not WELL_KNOWN < known[number] <= LOG_STD_LIMIT:
            continue
        shifted = x.copy()
        shifted[number] += np.log(2.0)
        rise = profile_cost_increase(problem, fitted, shifted, [number], tolerance=_TOLERANCE)
        stretch[number] = max(1.0, 0.5 / (std * np.sqrt(max(2.0 * rise, 1e-3))))
    return stretch
