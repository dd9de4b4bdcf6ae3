"""Essential parameters: base parameters with small relative standard deviations (Gautier 1997)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.regression import RegressionData
from flexcal.estimation import Estimate

_LARGEST_RATIO = 30.0
"""Largest ratio of relative standard deviations among the essential parameters (Khalil & Dombre 2002, 12.6: 10 to 30)."""
_LARGEST_GROWTH = 1.05
"""Largest norm of the residual relative to that with all base parameters."""


@dataclass(frozen=True, eq=False)
class EssentialParameters:
    """Essential base parameters: `names`, `values` and standard deviations `std` (e,) with the others set to zero.

    `eliminated` names the others in the order in which they went. `parameters` (p,) are those of all columns that go with it.
    """

    names: tuple[str, ...]
    values: np.ndarray
    std: np.ndarray
    eliminated: tuple[str, ...]
    parameters: np.ndarray


def essential_parameters(data: RegressionData, estimate: Estimate) -> EssentialParameters:
    """Eliminate the base parameter with the largest relative standard deviation, update the others, and repeat.

    The others follow by the covariance of the estimate, which is what autocorrelation leaves of least squares. It ends where the largest
    relative standard deviation is at most 30 times the smallest, or where the next step would make the residual of `data` more than
    5 % larger than with all base parameters. Those that the data hide, and their values, stay out of it.
    """
    base = data.base.identifiability
    hidden = {entry.name for entry in estimate.dropped}
    rows = [i for i, kept in enumerate(base.kept) if base.names[kept] not in hidden]
    kept = np.array([base.kept[i] for i in rows], dtype=int)
    parameters = estimate.parameters.coordinates()
    regrouped = base.regrouping[rows] @ parameters - parameters[kept]
    values = parameters[kept] + regrouped
    covariance = estimate.covariance[np.ix_(kept, kept)]
    alive = np.ones(len(kept), dtype=bool)
    eliminated: list[str] = []
    limit = _LARGEST_GROWTH * data.errors(parameters)[0]
    while alive.sum() > 1:
        relative = np.sqrt(np.diag(covariance)[alive]) / np.maximum(
            np.abs(values[alive]), np.finfo(float).tiny
        )
        if relative.max() <= _LARGEST_RATIO * relative.min():
            break
        worst = int(np.flatnonzero(alive)[np.argmax(relative)])
        along = covariance[:, worst] / covariance[worst, worst]
        shorter = values - along * values[worst]
        shorter[~alive] = shorter[worst] = 0.0
        candidate = parameters.copy()
        candidate[kept] = shorter - regrouped
        if data.errors(candidate)[0] > limit:
            break
        values, parameters = shorter, candidate
        covariance = covariance - np.outer(along, covariance[worst])
        alive[worst] = False
        eliminated.append(base.names[kept[worst]])
    return EssentialParameters(
        tuple(base.names[number] for number in kept[alive]),
        values[alive],
        np.sqrt(np.diag(covariance)[alive]),
        tuple(eliminated),
        parameters,
    )
