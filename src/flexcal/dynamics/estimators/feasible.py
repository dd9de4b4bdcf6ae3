"""Weighted least squares with physically consistent inertials (Sousa & Cortesão 2014)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.dynamics.estimators.linear_least_squares import weighted_system
from flexcal.dynamics.estimators.physical_constraints import feasible_set
from flexcal.dynamics.estimators.wls import noise_levels, weighted_least_squares
from flexcal.dynamics.regression import RegressionData
from flexcal.estimation import ConicFit, Estimate, Parameter, Parameters


def feasible_least_squares(data: RegressionData) -> Estimate:
    """Weighted least squares with positive masses and pseudo-inertias of the links, and dissipative drives.

    All parameters get values: of those that fit as well, the nearest to CAD and robot.yaml (`ConicFit.solve`, `feasible_set`), so that
    the links are bodies and can go back into a URDF. Covariance, `dropped` and `identifiable` are those of `weighted_least_squares`:
    the intervals are of the base parameters, given what the prior chose for the dropped ones. Constraints can only bring the estimate
    nearer to a feasible truth, in the norm of that covariance, so where some are active the intervals are wider than needed; a rise of
    the sum of squares far beyond the number of parameters tells that the model is wrong. Raises `FlexcalError` as
    `weighted_least_squares` and `ConicFit.solve` do.
    """
    linear = weighted_least_squares(data)
    system = weighted_system(data, noise_levels(data))
    names = list(data.names)
    cones = feasible_set(data.observation, system)
    bound = {number for cone in cones for number in cone.column_indices}
    kept = [number for number, seen in enumerate(linear.identifiable) if seen]
    free = [
        entry
        for entry in linear.dropped
        if bound & {names.index(name) for name in (entry.name, *(heir for heir, _ in entry.absorbed_by))}
    ]
    unseen = np.zeros((len(names), len(free)))
    for column, entry in zip(unseen.T, free, strict=True):
        column[names.index(entry.name)] = 1.0
        for heir, share in entry.absorbed_by:
            column[names.index(heir)] = -share
    fit = ConicFit(
        linear.parameters.coordinates(),
        _root(system.matrix, kept),
        unseen,
        cones,
        float(np.linalg.norm(system.right)) or 1.0,
    )
    nearest, rise = fit.solve()
    parameters = Parameters(
        Parameter(item.name, item.unit, float(value))
        for item, value in zip(linear.parameters, nearest, strict=True)
    )
    return replace(
        linear,
        parameters=parameters,
        cost=linear.cost + rise,
        chi2=linear.chi2 + rise,
        message=f"physically feasible; the weighted sum of squares is {rise:.3g} above its unconstrained minimum of {linear.cost:.6g}",
    )


def _root(matrix: np.ndarray, kept: list[int]) -> np.ndarray:
    """Square root (p, k): (RᵀR)⁻¹ = root rootᵀ for the kept columns, zero rows for the others."""
    scale = 1.0 / np.linalg.norm(matrix[:, kept], axis=0)
    triangle = np.linalg.qr(matrix[:, kept] * scale, mode="r")
    result = np.zeros((matrix.shape[1], len(kept)))
    result[kept] = scale[:, None] * np.linalg.inv(triangle)
    return result
