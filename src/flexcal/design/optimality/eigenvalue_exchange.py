"""Exchange for criteria of the eigenvalues: σ_min and O1-O5 (Sun & Hollerbach, "Active robot calibration algorithm", ICRA 2008).

In the eigenbasis V of M the diagonal of Vᵀ(M + ΘᵢᵀΘᵢ)V, λⱼ + |Θᵢvⱼ|², bounds the new eigenvalues (its least entry from above the least
of them, its largest from below the largest) and costs one product for all candidates. The criterion of that diagonal screens; the best few
are then judged by their exact eigenvalues.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from flexcal.design.optimality.criteria import DOptimal, SpectralCriterion, TraceOptimal
from flexcal.design.optimality.rank_updates import SELECTION_STAGE, Selection, greedy, rank_exchange
from flexcal.estimation import Sensitivity
from flexcal.progress import Progress, silent

SCREENED = 16
"""Largest number of candidates whose eigenvalues are computed exactly in every step."""
FIRST = 4
"""Number of these computed first: the score bounds the merit, so that those below the best of them are settled."""
LONGEST = 4
"""Largest number of members exchanged at once in an excursion."""
_ENOUGH = 1e-9


class _Pool:
    """Rows of all candidates and the information of the current set."""

    def __init__(self, sensitivity: Sensitivity, criterion: SpectralCriterion, chosen: list[int]) -> None:
        jacobian = sensitivity.jacobian
        self.candidates, self.rows, self.size = jacobian.shape
        self.jacobian = jacobian
        self.flat = np.ascontiguousarray(jacobian.reshape(-1, self.size))
        self.criterion = criterion
        members = jacobian[chosen].reshape(-1, self.size)
        self.information = members.T @ members
        if criterion.uses_prior:
            self.information = self.information + sensitivity.prior_information

    def product(self, candidate: int) -> np.ndarray:
        """Information ΘᵢᵀΘᵢ (p, p) of a candidate."""
        return self.jacobian[candidate].T @ self.jacobian[candidate]

    def best_addition(self, information: np.ndarray, banned: list[int]) -> tuple[int, float]:
        """Candidate whose addition to `information` gives the best merit, and that merit."""
        values, vectors = np.linalg.eigh(information)
        low = self._low(values, vectors)
        score = self._diagonal_merit(self.flat, values[:low], vectors[:, :low], 1.0)
        score[banned] = -np.inf
        few = np.argpartition(-score, min(SCREENED, self.candidates - 1))[:SCREENED]
        few = few[np.argsort(-score[few])]
        few = few[np.isfinite(score[few])]
        merits = self._exact(information, few[:FIRST])
        left = few[FIRST:][score[few[FIRST:]] > merits.max(initial=-np.inf)]
        if len(left):
            few = np.concatenate([few[:FIRST], left])
            merits = np.concatenate([merits, self._exact(information, left)])
        best = int(np.argmax(merits))
        return int(few[best]), float(merits[best])

    def _low(self, values: np.ndarray, vectors: np.ndarray) -> int:
        """Number of the lowest eigenvectors that determine the score: where only the least entry counts, none above the lowest's reach."""
        if self.criterion.name not in ("E", "O3"):
            return len(values)
        lowest = (self.flat @ vectors[:, 0]).reshape(-1, self.rows)
        reached = values[0] + np.einsum("ij,ij->i", lowest, lowest).max()
        return max(1, int(np.searchsorted(values, reached)))

    def _exact(self, information: np.ndarray, candidates: np.ndarray) -> np.ndarray:
        """Merit with each of some `candidates` added."""
        rows = self.jacobian[candidates]
        eigenvalues = np.linalg.eigvalsh(information + np.swapaxes(rows, 1, 2) @ rows)
        return self.criterion.of_eigenvalues(eigenvalues)

    def worst_member(self, information: np.ndarray, chosen: list[int]) -> tuple[int, float]:
        """Index in `chosen` of the member whose removal costs least, and the merit without it."""
        values, vectors = np.linalg.eigh(information)
        score = self._diagonal_merit(self.jacobian[chosen].reshape(-1, self.size), values, vectors, -1.0)
        few = np.argpartition(-score, min(SCREENED, len(chosen) - 1))[:SCREENED]
        rows = self.jacobian[[chosen[i] for i in few]]
        exact = np.linalg.eigvalsh(information - np.swapaxes(rows, 1, 2) @ rows)
        merits = self.criterion.of_eigenvalues(exact)
        worst = int(np.argmax(merits))
        return int(few[worst]), float(merits[worst])

    def _diagonal_merit(
        self, flat: np.ndarray, values: np.ndarray, vectors: np.ndarray, sign: float
    ) -> np.ndarray:
        seen = flat @ vectors
        np.multiply(seen, seen, out=seen)
        diagonal = seen.reshape(-1, self.rows, len(values)).sum(axis=1)
        diagonal *= sign
        diagonal += values
        return self.criterion.of_eigenvalues(diagonal)


def spectral_exchange(
    sensitivity: Sensitivity,
    count: int,
    criterion: SpectralCriterion,
    *,
    start: Sequence[int] | np.ndarray | None = None,
    passes: int = 20,
    progress: Progress = silent,
) -> Selection:
    """As `exchange`, for E and O2-O5: excursions, then exchanges member by member, until both fail. O1 is equivalent to D.

    Without `start` (which here must hold `count` indices) it begins twice, at the greedy and at the exchanged A-optimal set, since a set
    too small has σ_min = 0 and σ_min has many local optima; the better result counts.
    """
    if criterion.name == "O1":
        exchanged = rank_exchange(
            sensitivity, count, DOptimal(uses_prior=False), start=start, passes=passes, progress=progress
        )
        merits = np.exp(0.5 * np.array(exchanged.history))
        return Selection(exchanged.chosen, float(np.exp(0.5 * exchanged.merit)), tuple(merits.tolist()))
    progress(SELECTION_STAGE, 0.0)
    starts = [start] if start is not None else _starts(sensitivity, count)
    tried = []
    for number, chosen in enumerate(starts):

        def tell(share: float, done: int = number) -> None:
            progress(SELECTION_STAGE, (done + share) / len(starts))

        tried.append(_from(sensitivity, [int(i) for i in chosen], criterion, passes, tell))
    return max(tried, key=lambda selection: selection.merit)


def _starts(sensitivity: Sensitivity, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Start sets: the greedy and the exchanged A-optimal one."""
    smooth = TraceOptimal(np.eye(sensitivity.jacobian.shape[2]), "A", uses_prior=False)
    first = greedy(sensitivity, count, smooth).chosen
    return first, rank_exchange(sensitivity, count, smooth, start=first).chosen


def _from(
    sensitivity: Sensitivity,
    chosen: list[int],
    criterion: SpectralCriterion,
    passes: int,
    tell: Callable[[float], None],
) -> Selection:
    pool = _Pool(sensitivity, criterion, chosen)
    merit = criterion.merit(pool.information)
    history = [merit]
    for number in range(passes):
        tell(number / passes)
        merit = _excursions(pool, chosen, merit)
        merit = _exchange_once(pool, chosen, merit)
        history.append(merit)
        if not merit > history[-2] * (1 + _ENOUGH):
            break
    tell(1.0)
    return Selection(np.array(chosen), merit, tuple(history))


def _excursions(pool: _Pool, chosen: list[int], merit: float) -> float:
    """Add the best few and drop the worst few, or the other way round (DETMAX, Mitchell 1974); longer trips when shorter ones fail."""
    length = 1
    while length <= LONGEST:
        for steps in ((1,) * length + (-1,) * length, (-1,) * length + (1,) * length):
            trial, information, reached = list(chosen), pool.information, merit
            for step in steps:
                if step > 0:
                    added, reached = pool.best_addition(information, trial)
                    information = information + pool.product(added)
                    trial.append(added)
                else:
                    place, reached = pool.worst_member(information, trial)
                    information = information - pool.product(trial.pop(place))
            if reached > merit * (1 + _ENOUGH):
                chosen[:], pool.information, merit = trial, information, reached
                length = 0
                break
        length += 1
    return merit


def _exchange_once(pool: _Pool, chosen: list[int], merit: float) -> float:
    for place, member in enumerate(list(chosen)):
        smaller = pool.information - pool.product(member)
        best, reached = pool.best_addition(smaller, chosen)
        if reached > merit * (1 + _ENOUGH):
            pool.information = smaller + pool.product(best)
            chosen[place] = best
            merit = reached
    return merit
