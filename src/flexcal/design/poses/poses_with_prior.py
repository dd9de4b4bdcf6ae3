"""Number of chosen poses that with a prior from other robots reach what many random ones do without it."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.diagnostics import EnoughPoses
from flexcal.design.optimality import TraceOptimal, greedy
from flexcal.design.poses.feasibility import PoseCandidates
from flexcal.design.poses.selection import tool_error


def enough_with_prior(candidates: PoseCandidates, rng: np.random.Generator) -> EnoughPoses:
    """Predicted from the noise of a tracker: poses chosen one by one for the prior of the `candidates`, against random ones of them, where
    each parameter is known to its plausible size beforehand.
    """
    base, weight = candidates.base, candidates.tool_error_weight
    alone = base.with_prior(np.diag(base.tolerance**2))
    total = candidates.sample or len(candidates.pool)
    count = min(EnoughPoses.ALONE, total)
    sets = [rng.choice(total, count, replace=False) for _ in range(EnoughPoses.SETS)]
    goal = float(np.mean([tool_error(alone, weight, drawn) for drawn in sets]))
    order = greedy(base.sensitivity, count, TraceOptimal(weight, "c")).chosen
    return EnoughPoses.least(goal, count, lambda number: tool_error(base, weight, order[:number]))
