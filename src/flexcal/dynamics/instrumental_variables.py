"""Instrumental variables from the simulated closed loop (IDIM-IV): no bias by noise in velocities and accelerations (Janot et al. 2014)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.dynamics.batch_covariance import rows_of, score_covariance
from flexcal.dynamics.experiment_system import ExperimentSystem
from flexcal.dynamics.recorded_rows import RecordedRows
from flexcal.dynamics.regression import RegressionData
from flexcal.dynamics.simulated_iteration import simulated_iteration
from flexcal.dynamics.triangle import triangular
from flexcal.dynamics.wls import noise_levels, weighted_least_squares
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate, Parameter, Parameters

_WEAKEST = 1e-3
"""Smallest correlation of an instrument with what it stands for, of all directions of the parameters."""


def instrumental_variables(data: RegressionData, recorded: RecordedRows) -> Estimate:
    """χ̂ with ZᵀW χ̂ = ZᵀY, Z the observation matrix of the simulated closed loop with χ̂ itself, through the filters of W and Y.

    The rows of a joint and experiment are divided by `noise_levels` of theirs. Which parameters the data tell, and what the others
    absorb, is as in `weighted_least_squares`; the covariance is (ZᵀW)⁻¹ M (WᵀZ)⁻¹ with M that of `score_covariance`. Raises
    `FlexcalError` as `weighted_least_squares`, `feasible_least_squares` and `SimulatedExperiment` do, where the simulated motion has
    nothing to do with the recorded one, and where the iteration does not settle.
    """
    linear, noise = weighted_least_squares(data), noise_levels(data)
    members = data.observation.members
    return simulated_iteration(
        data, lambda robot: instrumental_fit(recorded.instrumented(robot), members, linear, noise), "IDIM-IV"
    )


def instrumental_fit(
    systems: Sequence[ExperimentSystem],
    members: Sequence[np.ndarray],
    linear: Estimate,
    noise: Sequence[float],
) -> Estimate:
    """ZᵀW χ̂ = ZᵀY of batches [Z, W, Y], where every joint has its `members` twice and Y.

    R of [Z, W, Y] stands for the products: R_ZW χ̂ = R_ZY, whose condition is not squared. What the least squares `linear` of the same
    equations did not estimate stays at its value. Raises `FlexcalError` where an instrument does not correlate.
    """
    start = linear.parameters.coordinates()
    kept = [number for number, seen in enumerate(linear.identifiable) if seen]
    size = len(kept)
    stack = []
    for number, system in enumerate(systems):
        for joint, own in enumerate(members):
            rows = np.vstack([batch.factors[joint] for batch in system.batches])
            sigma = noise[number * len(members) + joint]
            stack.append(triangular(rows @ (_columns(own, kept, start) / sigma)))
    whole = np.vstack(stack)
    norms = np.linalg.norm(whole, axis=0)
    scale = 1.0 / np.where(norms > 0, norms, 1.0)
    factor = triangular(whole * scale)
    instruments, regressors, right = np.split(factor, [size, 2 * size], axis=1)
    directions = np.linalg.qr(regressors, mode="reduced")[0]
    weakest = float(np.linalg.svd(directions[:size], compute_uv=False)[-1])
    if not weakest > _WEAKEST:
        raise FlexcalError(
            "the simulated motion does not show all that the recorded one does; check `controller:` in robot.yaml, or look at these "
            "data with --estimator wls."
        )
    root = scale[size:-1, None] * np.linalg.inv(regressors[:size])
    found = start.copy()
    found[kept] += root @ right[:size, 0] / scale[-1]
    whiten = scale[:size, None] * np.linalg.inv(instruments[:size])
    cost = float(np.sum((whole[:, size:] @ np.append(start[kept] - found[kept], 1.0)) ** 2))
    spread = score_covariance(
        [system.batches for system in systems],
        noise,
        [np.vstack([rows_of(whiten, kept, own), np.zeros((len(own) + 1, size))]) for own in members],
        [np.concatenate([np.zeros(len(own)), -found[own], [1.0]]) for own in members],
        root,
        cost / linear.degrees_of_freedom,
    )
    covariance = np.zeros_like(linear.covariance)
    covariance[np.ix_(kept, kept)] = spread.covariance
    return replace(
        linear,
        parameters=Parameters(
            Parameter(item.name, item.unit, float(value))
            for item, value in zip(linear.parameters, found, strict=True)
        ),
        covariance=covariance,
        cost=cost,
        chi2=cost,
        message=f"instrumental variables; their weakest correlation with the recorded motion is {weakest:.3g}",
        covariance_freedom=spread.freedom,
    )


def _columns(members: np.ndarray, kept: Sequence[int], start: np.ndarray) -> np.ndarray:
    """(2 m + 1, 2 k + 1): from a joint's [Z, W, Y] to the kept columns of Z, those of W, and Y less what `start` explains."""
    m, size = len(members), len(kept)
    chosen = rows_of(np.eye(size), kept, members)
    found = np.zeros((2 * m + 1, 2 * size + 1))
    found[:m, :size] = found[m : 2 * m, size : 2 * size] = chosen
    found[m : 2 * m, -1] = -start[members]
    found[-1, -1] = 1.0
    return found
