"""Very many random candidate poses, block by block: of each, the set that an exchange chooses goes on to the last exchange.

The union of locally optimal sets of parts is a composable core-set: what an exchange finds in it is nearly as good as what one finds among
all candidates (Indyk, Mahabadi, Oveis Gharan & Rezaei, SODA 2020; for local search, as here, Mahabadi et al., ICML 2019).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.poses import PosePool
from flexcal.design.optimality import Criterion, TraceBound, TraceOptimal, exchange_on_shortlist
from flexcal.design.poses.feasibility import PoseCandidates, drawn_configurations, full_sensitivity
from flexcal.design.poses.geometry_sensitivity import BaseSensitivity
from flexcal.design.scene import CollisionChecker
from flexcal.estimation import Sensitivity

BLOCK = 50_000
"""Number of candidates of a block, and the largest number that is looked at in one."""
_SAMPLE = 4000
"""Number of candidates beside the chosen ones in the last exchange, as a random sample of all."""


@dataclass(frozen=True, eq=False)
class BlockedCandidates:
    """Search among `total` candidates in blocks; `first` are those of the first block.

    Parameter combinations, their tolerances and the weight of the tool error are those of the first block. `bound` is that of the tool
    error over all blocks; each has `block` candidates, the last one the rest.
    """

    first: PoseCandidates
    checker: CollisionChecker
    criterion: Criterion
    count: int
    total: int
    seed: int
    bound: TraceBound
    block: int

    @classmethod
    def of(
        cls,
        first: PoseCandidates,
        checker: CollisionChecker,
        criterion: Criterion,
        count: int,
        total: int,
        seed: int,
        block: int = BLOCK,
    ) -> BlockedCandidates:
        """Search that begins with the candidates `first`; `seed` and its number make a block's own random numbers."""
        bound = TraceBound.of(first.base.sensitivity, TraceOptimal(first.tool_error_weight, "c"), count)
        return cls(first, checker, criterion, count, total, seed, bound, block)

    def without_first(self) -> BlockedCandidates:
        """Search without the poses of the first block, for another process."""
        base, pool = self.first.base, self.first.pool
        few = replace(base, sensitivity=base.sensitivity.subset([0]))
        return replace(self, first=replace(self.first, pool=pool.subset(np.arange(1)), base=few))

    @property
    def blocks(self) -> range:
        """Numbers of the blocks after the first."""
        return range(1, -(-self.total // self.block))

    def chosen(self, number: int) -> ChosenOfBlock:
        """What an exchange chooses of the block of that number; raises `FlexcalError` as `random_candidates` and `exchange` do."""
        rng = np.random.default_rng([self.seed, 2, number])
        size = min(self.block, self.total - number * self.block)
        q = drawn_configurations(self.checker, size, rng, self.first.setup)
        return self._of(q, self.rows(q))

    def chosen_of_first(self) -> ChosenOfBlock:
        """As `chosen`, of the first block."""
        return self._of(self.first.pool.q, self.first.base.sensitivity)

    def _of(self, q: np.ndarray, rows: Sensitivity) -> ChosenOfBlock:
        if len(q) <= self.count:
            largest = self.bound.largest(rows) if len(q) else 0.0
            return ChosenOfBlock(q, -np.inf, largest, len(q))
        selection = exchange_on_shortlist(rows, self.count, self.criterion)
        return ChosenOfBlock(q[selection.chosen], selection.merit, self.bound.largest(rows), len(q))

    def rows(self, q: np.ndarray) -> Sensitivity:
        """Rows of poses `q` (N, n) in the first block's combinations."""
        base = self.first.base
        full = full_sensitivity(self.first.model, q, self.first.setup, self.first.fleet)
        known = [name for name in base.identifiability.kept_names if name in full.parameters.names]
        places = [base.identifiability.kept_names.index(name) for name in known]
        jacobian = np.zeros((*full.jacobian.shape[:2], len(base.scale)))
        jacobian[:, :, places] = full.jacobian[:, :, [full.parameters.names.index(name) for name in known]]
        jacobian *= base.scale
        return Sensitivity(jacobian, base.sensitivity.parameters, base.sensitivity.prior_information)

    def united(self, chosen: Sequence[ChosenOfBlock]) -> PoseCandidates:
        """Candidates of the last exchange: a random sample of the first block, then what was `chosen` of all blocks, in their order."""
        sample = self.first.pool.q[:_SAMPLE]
        q = np.concatenate([sample, *(one.q for one in chosen)])
        rows = self.rows(q)
        best = int(np.argmax([one.merit for one in chosen]))
        begin = len(sample) + sum(len(one.q) for one in chosen[:best])
        base = BaseSensitivity(
            rows, self.first.base.identifiability, self.first.base.scale, self.first.base.tolerance
        )
        return replace(
            self.first,
            pool=PosePool(q, np.arange(1, len(q) + 1), self.first.pool.payload),
            base=base,
            looked_at=sum(one.candidates for one in chosen),
            sample=len(sample),
            start=np.arange(begin, begin + len(chosen[best].q)),
            bound=self.bound,
            largest=max(one.largest for one in chosen),
        )


@dataclass(frozen=True, eq=False)
class ChosenOfBlock:
    """Set `q` (count, n) chosen among the `candidates` of a block, with its `merit`; `largest` is `TraceBound.largest` of all of them."""

    q: np.ndarray
    merit: float
    largest: float
    candidates: int
