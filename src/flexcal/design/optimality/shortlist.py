"""Selection from very many candidates: exchange on a shortlist that is renewed until the selection does not change.

What candidate i would add to a set of information M is, to first order, tr(G ΘᵢᵀΘᵢ) with G the derivative of the merit by M (the function
of the equivalence theorem: Kiefer, "General equivalence theory for optimum designs", 1974). One product ranks all candidates so. σ_min
has such a derivative along one eigenvector only; of the others that it would soon meet, each counts by a power of its eigenvalue.
"""

from __future__ import annotations

import numpy as np

from flexcal.design.optimality.criteria import Criterion, SpectralCriterion
from flexcal.design.optimality.exchange_algorithm import exchange
from flexcal.design.optimality.rank_updates import SELECTION_STAGE, Selection
from flexcal.estimation import Sensitivity
from flexcal.progress import Progress, silent

SHORT = 1000
"""Number of candidates on the shortlist."""
MANY = 5000
"""Number of candidates above which a shortlist pays."""
ROUNDS = 6
_POWER = 9
"""Exponent of the weight of an eigenvector, one over its eigenvalue: the derivative of (Σ λ⁻⁸)^(-1/8), nearly the least eigenvalue."""
_LIGHT = 1e-3
"""Relative weight below which an eigenvector is left out."""


def exchange_on_shortlist(
    sensitivity: Sensitivity,
    count: int,
    criterion: Criterion,
    *,
    start: np.ndarray | None = None,
    progress: Progress = silent,
) -> Selection:
    """Exchange from any number of candidates, as `exchange`; above 5000 it considers 1000 at a time.

    It begins with the set `start` (count,), without one among candidates drawn at random (always the same ones), then goes on among those
    that promise most beside the set found, until that set stays or after six rounds. Raises `FlexcalError` as `exchange` does.
    """
    if len(sensitivity) <= MANY:
        return exchange(sensitivity, count, criterion, start=start, progress=progress)
    short = min(len(sensitivity), max(SHORT, 4 * count))
    chosen, history = np.asarray(start), []
    if start is None:
        listed = np.random.default_rng(0).choice(len(sensitivity), short, replace=False)
        selection = exchange(sensitivity.subset(listed), count, criterion)
        chosen, history = listed[selection.chosen], [selection.merit]
    for number in range(ROUNDS):
        progress(SELECTION_STAGE, (number + 1) / (ROUNDS + 1))
        promise = predicted_gains(sensitivity, chosen, criterion)
        promise[chosen] = np.inf
        listed = np.argpartition(-promise, short - 1)[:short]
        place = {int(candidate): k for k, candidate in enumerate(listed)}
        selection = exchange(
            sensitivity.subset(listed), count, criterion, start=[place[int(i)] for i in chosen]
        )
        before, chosen = chosen, listed[selection.chosen]
        history.append(selection.merit)
        if set(chosen) == set(before):
            break
    progress(SELECTION_STAGE, 1.0)
    return Selection(chosen, history[-1], tuple(history))


def predicted_gains(sensitivity: Sensitivity, chosen: np.ndarray, criterion: Criterion) -> np.ndarray:
    """Gain (candidates,) in the merit of the `chosen` ones by adding each candidate, to first order and up to a factor."""
    size = len(sensitivity.parameters)
    rows = sensitivity.jacobian[chosen].reshape(-1, size)
    information = rows.T @ rows
    if criterion.uses_prior:
        information = information + sensitivity.prior_information
    if isinstance(criterion, SpectralCriterion):
        values, vectors = np.linalg.eigh(information)
        weight = (values[0] / values) ** _POWER
    else:
        weight, vectors = np.linalg.eigh(criterion.gradient(information))
        weight = np.maximum(weight, 0.0)
    heavy = weight > _LIGHT * weight.max() if isinstance(criterion, SpectralCriterion) else weight > 0
    seen = sensitivity.jacobian.reshape(-1, size) @ (vectors * np.sqrt(weight))[:, heavy]
    np.multiply(seen, seen, out=seen)
    return seen.reshape(len(sensitivity), -1).sum(axis=1)
