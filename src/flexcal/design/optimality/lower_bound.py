"""Lower bound of the criterion for a number of poses, from the equivalence theorem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.design.optimality.criteria import TraceOptimal
from flexcal.design.optimality.rank_updates import greedy
from flexcal.estimation import Sensitivity

LOOKED_AT = 2000
"""Number of candidates searched for a good design."""
SPREAD = 4
"""Number of candidates in that design per parameter: sufficient for weights near the best."""


@dataclass(frozen=True, eq=False)
class TraceBound:
    """Lower bound of tr(W M'⁻¹) for any set of candidates, M' their information with the prior P.

    tr(W M⁻¹) is convex in M and goes with 1/t as M with t, so that for every M', M and t > 0 it is at least 2 φ/t - tr(S M')/t², with φ
    its value and S = M⁻¹ W M⁻¹ at M; the best t is tr(S M')/φ, and tr(S M') is at most tr(S P) + count · maxᵢ tr(S ΘᵢᵀΘᵢ). Whatever M,
    φ² / (tr(S P) + count · maxᵢ tr(S ΘᵢᵀΘᵢ)) is such a number, and the nearer M is to optimal the tighter (Pukelsheim, Optimal Design
    of Experiments, ch. 7). `value` is φ, `root` (p, p) has root · rootᵀ = S, and `known` is tr(S P).
    """

    value: float
    root: np.ndarray
    known: float

    @classmethod
    def of(cls, sensitivity: Sensitivity, criterion: TraceOptimal, count: float) -> TraceBound:
        """Bound at the M of a large set found greedily among some of the candidates, weighted to `count` of them."""
        size, prior = len(sensitivity.parameters), sensitivity.prior_information
        few = np.unique(np.linspace(0, len(sensitivity) - 1, min(len(sensitivity), LOOKED_AT)).astype(int))
        looked_at = sensitivity.subset(few)
        many = min(len(few), SPREAD * size)
        rows = looked_at.jacobian[greedy(looked_at, many, criterion).chosen].reshape(-1, size)
        information = prior + count / many * (rows.T @ rows)
        value = criterion.trace(information)
        slope = 2 * value * criterion.gradient(information)
        values, vectors = np.linalg.eigh(slope)
        return cls(value, vectors * np.sqrt(np.maximum(values, 0.0)), float(np.sum(slope * prior)))

    def largest(self, sensitivity: Sensitivity) -> float:
        """Maximum of tr(S ΘᵢᵀΘᵢ) over candidates."""
        seen = sensitivity.jacobian.reshape(-1, len(self.root)) @ self.root
        return float(np.square(seen, out=seen).reshape(len(sensitivity), -1).sum(axis=1).max())

    def least(self, counts: np.ndarray, largest: float) -> np.ndarray:
        """Bounds (K,) for `counts` (K,) candidates whose `largest` is the maximum over all of them."""
        return self.value**2 / (self.known + np.asarray(counts) * largest)


def trace_lower_bound(sensitivity: Sensitivity, criterion: TraceOptimal, counts: np.ndarray) -> np.ndarray:
    """`TraceBound` (K,) for any set of `counts` (K,) candidates; M has as many as the counts are in the middle."""
    bound = TraceBound.of(sensitivity, criterion, float(np.sqrt(np.min(counts) * np.max(counts))))
    return bound.least(counts, bound.largest(sensitivity))
