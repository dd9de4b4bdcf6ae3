"""Whether the readings of a visit scatter more than was assumed of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.recheck.global_test import GlobalTest
from flexcal.calibration.recheck.visit_errors import VisitErrors

_CHANCE = 0.05
"""Probability below which what is left about the best explanation, and about all together, is more scatter than assumed."""
LARGEST = 4.0
"""Factor above which errors that no change explains are hardly noise: of a model or poses that are others."""
_FACTORS = np.geomspace(1.0, LARGEST, 60)
_LEAST = 6
"""Least number of coordinates beside all changes that tell the scatter."""


@dataclass(frozen=True)
class LargerScatter:
    """Readings of a visit that scatter `factor` times as much as was assumed, by `freedom` coordinates that no change of the robot
    explains; `chance` is the probability that noise as assumed scatters as much.
    """

    factor: float
    freedom: int
    chance: float

    @property
    def std(self) -> float:
        """Standard deviation of the factor, of normal errors."""
        return self.factor / float(np.sqrt(2 * self.freedom))

    def applied(self, errors: VisitErrors) -> VisitErrors:
        """The errors with this scatter of the visit."""
        return replace(errors, own=self.factor**2 * errors.own, freedom=float(self.freedom))


def unexplained(test: GlobalTest) -> tuple[float, int]:
    """Sum of squares of the whitened errors that all changes together do not explain, and its degrees of freedom."""
    whitened = test.whitening @ test.errors.errors
    every = np.hstack([item.basis for item in test.seen] or [np.zeros((test.size, 0))])
    basis, sizes, _ = np.linalg.svd(every, full_matrices=False)
    basis = basis[:, sizes > 1e-6]
    left = whitened - basis @ (basis.T @ whitened)
    return float(left @ left), test.size - basis.shape[1]


def scatter_about(test: GlobalTest, remainders: Sequence[float], together: float) -> LargerScatter | None:
    """The larger scatter of a visit; None where one change leaves no more than noise as assumed, or all `together` do.

    `remainders` are the probabilities that noise leaves what each change does not explain, `together` that of all. The size is estimated
    from what all together leave, so that no change that is tested by it is part of it (F test).
    """
    left, freedom = unexplained(test)
    if freedom < _LEAST or max(remainders, default=0.0) > _CHANCE or together > _CHANCE:
        return None
    whole = left / freedom
    # noise of the reference visit, or of the calibration, is what it was
    errors = test.errors
    share = float(np.trace(errors.common) / np.trace(errors.own))
    factor = float(np.sqrt(whole + (whole - 1) * share))
    return LargerScatter(factor, freedom, together) if factor <= LARGEST else None


def scatter_alone(test: GlobalTest) -> tuple[LargerScatter, float]:
    """The likeliest factor of a scatter that explains the errors of a visit by itself, and twice its negative log-likelihood."""
    errors, whitening = test.errors, test.whitening
    own, common = (whitening @ part @ whitening.T for part in (errors.own, errors.common))
    whitened = whitening @ errors.errors
    roots = [np.linalg.cholesky(factor**2 * own + common) for factor in _FACTORS]
    costs = [
        test.cost(float(np.sum(np.linalg.solve(root, whitened) ** 2)))
        + 2 * float(np.log(np.diag(root)).sum())
        for root in roots
    ]
    best = int(np.argmin(costs))
    chance = float(test.chance(float(whitened @ whitened), test.size))
    return LargerScatter(float(_FACTORS[best]), test.size, chance), costs[best]
