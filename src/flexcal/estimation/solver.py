"""Solution of a `Problem`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation.estimate import Estimate
from flexcal.estimation.identifiability import RANK_TOLERANCE, Identifiability
from flexcal.estimation.levenberg_marquardt import FIRST_DAMPING, Optimum, minimise
from flexcal.estimation.loss import OUTLIER_WEIGHT, Loss, Squares, loss_named
from flexcal.estimation.objective import Objective
from flexcal.estimation.parameter import Parameters
from flexcal.estimation.problem import Problem
from flexcal.estimation.uncertainty import is_log_identified, sandwich, uncertainty
from flexcal.progress import Progress, silent

_SAME_OPTIMUM = 1e-3


def solve(
    problem: Problem,
    *,
    loss: Loss | Literal["squares", "huber", "cauchy"] = "squares",
    starts: np.ndarray | None = None,
    covariance: Literal["posterior", "sandwich"] = "posterior",
    max_iterations: int = 200,
    tolerance: float = 1e-9,
    rank_tolerance: float = RANK_TOLERANCE,
    prefer: Sequence[str] = (),
    damping: float = FIRST_DAMPING,
    progress: Progress = silent,
) -> Estimate:
    """Minimise a problem, and determine rank and covariance at the optimum.

    Levenberg–Marquardt from the parameters' values, or from each row of `starts` (s, p, estimation coordinates): the best
    counts, and the message says how many reached its cost to within 1e-3. Where the rank at the optimum is deficient
    (relative `rank_tolerance`, see `analyse` and its `prefer`), the dropped parameters go back to their values in
    `problem.parameters` and the kept ones are fitted again. `covariance`: "posterior" trusts whitening and prior,
    "sandwich" lets the scatter of the groups speak. `loss` is robust on group norms; groups whose weight ends below 0.2 are
    listed as outliers. `damping` is that of the first step, less for a problem that is nearly linear. `progress` is called at
    every iteration, with its share of `max_iterations`.

    Raises FlexcalError for shapes that do not fit, a model that cannot be evaluated at any start, or no rows at all. A fit
    that does not converge is returned with its status and a message that says what to do.
    """
    chosen, parameters = loss_named(loss), problem.parameters
    if covariance not in ("posterior", "sandwich"):
        raise FlexcalError(
            "E-FIT-026", f"There is no covariance '{covariance}'; use 'posterior' or 'sandwich'."
        )
    points = _starts(parameters, starts)
    objective, optima = None, []
    failure: FlexcalError | None = None
    for point in points:
        try:
            if problem.residual is None:
                first = problem.linearise(point)
                residual = first[0]
            else:
                first, residual = None, problem.residual(point)
            if objective is None:
                objective = Objective.of(problem, chosen, np.size(residual))
            optima.append(
                minimise(
                    objective,
                    point,
                    np.ones(len(parameters), dtype=bool),
                    max_iterations=max_iterations,
                    tolerance=tolerance,
                    progress=progress,
                    first=first,
                    damping=damping,
                )
            )
        except FlexcalError as error:
            failure = error
    if objective is None or not optima:
        raise failure or FlexcalError("E-FIT-027", "There is no start to solve from; starts has no rows.")
    best = min(optima, key=lambda optimum: optimum.cost)
    reached = ""
    if starts is not None:
        same = sum(o.cost <= best.cost * (1 + 1e-9) + _SAME_OPTIMUM for o in optima)
        reached = f"; {same} of {len(points)} starts reached this optimum"
        if len(optima) < len(points):
            reached += f", at {len(points) - len(optima)} the model could not be evaluated"

    at = uncertainty(objective, best, prefer, rank_tolerance)
    if at.identifiability.rank < len(parameters):
        best = _refitted(objective, best, at.identifiability, max_iterations, tolerance)
        at = uncertainty(objective, best, at.identifiability.kept_names, rank_tolerance)
        reached += f"; rank {at.identifiability.rank} of {len(parameters)}"
    posterior = at.root @ at.root.T if covariance == "posterior" else sandwich(objective, best, at)
    outliers = () if isinstance(chosen, Squares) else np.flatnonzero(best.weights < OUTLIER_WEIGHT)
    return Estimate(
        parameters=parameters.with_coordinates(best.x),
        covariance=posterior,
        rank=at.identifiability.rank,
        dropped=at.identifiability.dropped,
        identifiable=_identifiable(parameters, at.identifiability, posterior),
        cost=best.cost,
        chi2=at.chi2,
        degrees_of_freedom=max(0, round(at.rows - at.effective)),
        status=best.status,
        message=best.message + reached,
        iterations=sum(optimum.iterations for optimum in optima),
        outliers=tuple(int(objective.grouping.labels[i]) for i in outliers),
    )


def _starts(parameters: Parameters, starts: np.ndarray | None) -> np.ndarray:
    """Starts (s, p) within the bounds; raises FlexcalError when their shape does not fit."""
    if not len(parameters):
        raise FlexcalError("E-FIT-028", "There are no parameters to estimate; give the problem at least one.")
    points = parameters.coordinates()[None] if starts is None else np.asarray(starts, dtype=float)
    if points.ndim != 2 or points.shape[1] != len(parameters):
        raise FlexcalError(
            "E-FIT-029",
            f"starts has shape {points.shape}; {len(parameters)} parameters need (starts, {len(parameters)}).",
        )
    return np.clip(points, *parameters.bounds())


def _refitted(
    objective: Objective,
    optimum: Optimum,
    identifiability: Identifiability,
    max_iterations: int,
    tolerance: float,
) -> Optimum:
    """The optimum with the dropped parameters at their start values, unless that fits worse (a rank lost at this point only)."""
    size = optimum.x.size
    kept = np.isin(np.arange(size), identifiability.kept)
    start = objective.problem.parameters.coordinates()
    x = np.where(kept, optimum.x, start)
    x[kept] += identifiability.regrouping[:, ~kept] @ (optimum.x - start)[~kept]
    try:
        again = minimise(objective, x, kept, max_iterations=max_iterations, tolerance=tolerance)
    except FlexcalError:
        return optimum
    return again if again.cost <= optimum.cost * (1 + 1e-6) + _SAME_OPTIMUM else optimum


def _identifiable(
    parameters: Parameters, identifiability: Identifiability, covariance: np.ndarray
) -> tuple[bool, ...]:
    kept = set(identifiability.kept)
    return tuple(i in kept and known for i, known in enumerate(is_log_identified(parameters, covariance)))
