"""How good any choice of so many poses could be, from the equivalence theorem."""

from __future__ import annotations

import numpy as np

from flexcal.design.criteria import TraceOptimal
from flexcal.estimation import Sensitivity


def least_trace(
    sensitivity: Sensitivity, information: np.ndarray, criterion: TraceOptimal, prior: np.ndarray, count: int
) -> float:
    """A number that tr(W M'⁻¹) of no set of `count` candidates is below, M' their information and the `prior` (p, p), found at some M (p, p).

    tr(W M⁻¹) is convex in M and goes with 1/t as M with t, so that for every M' and t > 0 it is at least 2 φ/t - tr(S M')/t², with φ its
    value and S = M⁻¹ W M⁻¹ at M; the best t is tr(S M')/φ, and tr(S M') is at most that of the prior and `count` times the best
    candidate: φ² / (tr(S P) + count · maxᵢ tr(S ΘᵢᵀΘᵢ)). Tight where M is optimal (Pukelsheim, Optimal Design of Experiments, ch. 7).
    """
    value = criterion.trace(information)
    spread = 2 * value * criterion.gradient(information)
    factor = np.linalg.cholesky(spread + 1e-14 * np.trace(spread) * np.eye(len(spread)))
    seen = sensitivity.jacobian.reshape(-1, len(spread)) @ factor
    best = float(np.square(seen, out=seen).reshape(len(sensitivity), -1).sum(axis=1).max())
    return value**2 / (float(np.sum(spread * prior)) + count * best)
