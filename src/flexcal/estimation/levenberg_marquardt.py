"""Levenberg–Marquardt with bounds, on the triangular factor of each linearisation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.estimation.anderson_acceleration import AndersonAcceleration
from flexcal.estimation.objective import Objective
from flexcal.progress import Progress, silent

FIRST_DAMPING = 1e-3
"""Damping of the first step, relative to the largest columns' squares, of a problem of which nothing is known (Nielsen 1999)."""
_LARGEST_DAMPING = 1e14
_SMALLEST_DAMPING = 1e-18
_ROUNDING = 1e-13
_STATIONARY, _SHORT = 1e-3, 0.1
"""Relative offset, and step in standard deviations of the estimate, at which a fit that cannot go on is at its minimum."""
_EXACT = 1e-16
_CLOSE = 0.1
"""Relative offset and deviation of the gain ratio from 1 below which a minimum is near: the damping starts lower and falls ever faster."""
_CANNOT_STEP = {
    True: ("converged", "the cost no longer changes beyond rounding"),
    False: ("stalled", "no step lowers the cost, although it is not at a minimum"),
}


@dataclass(frozen=True, eq=False)
class Optimum:
    """Result of a minimisation: coordinates, residual, Jacobian and robust group weights there, cost, and termination."""

    x: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    weights: np.ndarray
    cost: float
    status: str
    message: str
    iterations: int


def minimise(
    objective: Objective,
    x: np.ndarray,
    free: np.ndarray,
    *,
    max_iterations: int,
    tolerance: float,
    progress: Progress = silent,
    first: tuple[np.ndarray, np.ndarray] | None = None,
    damping: float = FIRST_DAMPING,
) -> Optimum:
    """Minimise over the coordinates marked in `free` (p,), from `x` (p,), where the linearisation may be known as `first`.

    Damping follows the gain ratio (Nielsen 1999; Madsen, Nielsen, Tingleff 2004, alg. 3.16) in coordinates scaled by the
    largest column norms seen (Moré 1978). Robust losses are reweighted at every linearisation; the weighted quadratic
    bounds them from above, so the gain ratio keeps its meaning. Near the minimum, while the gain ratio stays near 1, each
    fall of the damping is three times the last one, and a fit that starts near it starts with less, or weak directions would take a
    dozen steps. There the steps are accelerated (`AndersonAcceleration`) unless that raises the cost. Steps are clipped at the
    bounds, and a coordinate that is at one and pushed outwards rests for that step. Directions without information are not
    moved.

    Converged: the relative offset ‖Qᵀb‖/‖b‖ (Bates & Watts 1981) or the scaled step is below `tolerance`, or the cost no
    longer changes beyond rounding, or after `max_iterations` the relative offset is at most 1e-3, which Bates and Watts suggest, or
    0.1/√n for n residuals: the step is then a tenth of a standard deviation, over all coordinates together.
    Stalled: no step lowers the cost although the relative offset is above that, and the cost not yet 1e-16 of the first one. Raises
    FlexcalError when the start itself cannot be evaluated.
    """
    lower, upper = objective.problem.parameters.bounds()
    x = np.clip(x, lower, upper)
    residual, jacobian = objective.linearise(x) if first is None else objective.checked(*first)
    cost = first_cost = objective.cost(residual, x)
    scale = np.zeros(x.size)
    growth, fall, best_offset = 2.0, 1.0 / 3.0, np.inf
    status, message, iteration, polishing = "iteration limit", "", 0, False
    acceleration, moved = AndersonAcceleration(), np.zeros(0, dtype=int)
    stationary = max(_STATIONARY, _SHORT / np.sqrt(max(residual.size, 1)))
    while True:
        progress("fitting", iteration / max_iterations)
        weights = objective.weights(residual)
        factor, target, norm = objective.triangular(x, residual, jacobian, weights)
        scale = np.maximum(scale, np.linalg.norm(factor, axis=0))
        unit = np.where(scale > 0, scale, 1.0)
        gradient = factor.T @ target
        outwards = ((x <= lower) & (gradient > 0)) | ((x >= upper) & (gradient < 0))
        moving = np.flatnonzero(free & ~outwards)
        left, singular, right = np.linalg.svd(factor[:, moving] / unit[moving], full_matrices=False)
        known = singular > 1e-13 * np.max(singular, initial=0.0)
        left, singular, right = left[:, known].T @ target, singular[known], right[known]
        offset = float(np.linalg.norm(left)) / norm if norm > 0 else 0.0
        if not iteration:
            damping *= min(1.0, offset / _CLOSE) ** 2
        if offset <= tolerance:
            status, message = "converged", f"relative offset {offset:.1e}"
            break
        if polishing and offset >= 0.5 * best_offset:
            if not acceleration.extrapolates:
                status, message = "converged", "the cost no longer changes beyond rounding"
                break
            acceleration.forget()
        best_offset = min(best_offset, offset)
        if iteration >= max_iterations:
            if offset <= stationary:
                status, message = "converged", f"relative offset {offset:.1e}, after {iteration} iterations"
                break
            message = f"not converged after {iteration} iterations (relative offset {offset:.1e}); allow more"
            break
        iteration += 1
        linearised, rejected, accelerated = None, False, offset < _CLOSE
        if not (accelerated and np.array_equal(moving, moved)):
            acceleration.forget()
        moved = moving
        while True:
            step = np.zeros(x.size)
            step[moving] = -(right.T @ (singular * left / (singular**2 + damping))) / unit[moving]
            if accelerated:
                step = acceleration.step(x, step, factor)
            trial = np.clip(x + step, lower, upper)
            step = trial - x
            if damping > _LARGEST_DAMPING or np.linalg.norm(unit * step) <= tolerance * 1e-3 * np.linalg.norm(
                unit * x
            ):
                negligible = not rejected or offset <= stationary or cost <= _EXACT * first_cost
                status, message = _CANNOT_STEP[negligible]
                break
            # an extrapolated step is one of Newton's, whose Hessian is not that of the linearisation
            bend = -gradient @ step if acceleration.extrapolates else np.sum((factor @ step) ** 2)
            predicted = -float(gradient @ step) - 0.5 * float(bend)
            trial_cost, linearised = objective.trial(trial)
            actual = cost - trial_cost
            polishing = abs(predicted) <= _ROUNDING * cost and abs(actual) <= 10 * _ROUNDING * cost
            gain = 1.0 if polishing else actual / predicted if predicted > 0 else -1.0
            if gain > 1e-4:
                close = offset < _CLOSE and abs(gain - 1.0) < _CLOSE
                damping *= fall if close else max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
                damping, growth = max(damping, _SMALLEST_DAMPING), 2.0
                fall = fall / 3.0 if close else 1.0 / 3.0
                break
            if not acceleration.extrapolates:
                damping, growth, rejected = damping * growth, growth * 2.0, True
            # the same point again with another step is no point of the iteration
            acceleration.forget()
            accelerated = False
        if status != "iteration limit":
            break
        x = trial
        residual, jacobian = linearised if linearised is not None else objective.linearise(x)
        cost = objective.cost(residual, x)
    return Optimum(x, residual, jacobian, weights, cost, status, message, iteration)
