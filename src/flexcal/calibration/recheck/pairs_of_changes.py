"""Two changes of a robot that together explain the errors of a visit."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import comb, log

import numpy as np

from flexcal.calibration.recheck.change_effects import PossibleChange
from flexcal.calibration.recheck.global_test import FALSE_ALARM, GlobalTest, misfit_of

Pair = tuple[PossibleChange, PossibleChange]


@dataclass(frozen=True)
class FittedPair:
    """Two `changes` with the sum of squares that they leave, whitened, their number of independent parameters, and the number of
    `alternatives` that were tried.
    """

    changes: Pair
    misfit: float
    rank: int
    alternatives: int

    def score(self, test: GlobalTest) -> float:
        """Twice the negative log-likelihood, with what Schwarz's criterion adds for the parameters and for the number of pairs."""
        return test.cost(self.misfit) + self.rank * log(test.size) + 2 * log(self.alternatives)


def pairs_of_changes(test: GlobalTest, root: np.ndarray, values: np.ndarray) -> list[FittedPair]:
    """All two changes, neither of them of the instrument and none a part of the other, fitted to whitened `values` (m,).

    `root` (m, m) is a Cholesky factor of the covariance of the values.
    """
    robot = [item for item in test.seen if item.change.kind != "instrument_moved"]
    bases = [np.linalg.solve(root, item.basis) for item in robot]
    left = np.linalg.solve(root, values)
    found, pairs = [], comb(len(robot), 2)
    for one, other in combinations(range(len(robot)), 2):
        misfit, rank = misfit_of(left, np.hstack([bases[one], bases[other]]))
        if rank == bases[one].shape[1] + bases[other].shape[1]:
            found.append(FittedPair((robot[one].change, robot[other].change), misfit, rank, pairs))
    return found


def two_changes(test: GlobalTest) -> FittedPair | None:
    """The two changes that leave least, where chance leaves as much; None where no two do."""
    pairs = pairs_of_changes(test, np.eye(test.size), test.whitening @ test.errors.errors)
    chances = [
        float(test.chance(pair.misfit, test.size - pair.rank)) if test.size > pair.rank else 0.0
        for pair in pairs
    ]
    best = int(np.argmax(chances)) if pairs else -1
    return pairs[best] if best >= 0 and chances[best] > FALSE_ALARM else None
