"""Poses that are still to be measured, chosen together for the least tool error after all of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from flexcal.design.optimality import TraceOptimal, exchange, exchange_on_shortlist, greedy
from flexcal.estimation import Parameter, Parameters, Sensitivity
from flexcal.jobs.guidance.pose_choice import PoseChoice

_NEIGHBOURS = 30
_SHARES = (0.05, 0.05, 0.03, 0.02)
"""Distances of the neighbours that are tried round by round, as shares of the joint ranges."""


@dataclass(frozen=True, eq=False)
class OpenPoses:
    """Poses `q` (M, n) that are not measured, their numbers `pose` (M,), and whitened derivatives `columns` (M, 3, p) of their points."""

    q: np.ndarray
    pose: np.ndarray
    columns: np.ndarray

    def __len__(self) -> int:
        return len(self.q)

    def subset(self, index: np.ndarray) -> OpenPoses:
        """The poses at these indices, in their order."""
        return OpenPoses(self.q[index], self.pose[index], self.columns[index])

    def with_further(self, others: OpenPoses) -> OpenPoses:
        """These poses, then others."""
        return OpenPoses(
            np.concatenate([self.q, others.q]),
            np.concatenate([self.pose, others.pose]),
            np.concatenate([self.columns, others.columns]),
        )

    def information(self, count: int) -> np.ndarray:
        """Information (p, p) of the first `count` poses."""
        rows = self.columns[:count].reshape(-1, self.columns.shape[2])
        return rows.T @ rows


@dataclass(frozen=True, eq=False)
class BatchDesign:
    """Choice of poses beside the `information` (p, p) that is there, for the least mean square of the errors with derivatives `working`
    (W, 3, p), m; `look` gives poses (M, n) with numbers (M,) those of them that are not measured."""

    choice: PoseChoice
    information: np.ndarray
    working: np.ndarray
    look: Callable[[np.ndarray, np.ndarray], OpenPoses]

    def best(self, poses: OpenPoses, count: int) -> OpenPoses:
        """The best set of `count` poses; a local optimum by exchange."""
        return poses.subset(
            exchange_on_shortlist(self._sensitivity(poses), count, self._criterion).chosen.astype(int)
        )

    def ordered(self, batch: OpenPoses, count: int) -> OpenPoses:
        """`count` poses of a batch, each the best after those before it."""
        return batch.subset(greedy(self._sensitivity(batch), count, self._criterion).chosen.astype(int))

    def after(self, batch: OpenPoses, poses: OpenPoses, count: int) -> OpenPoses:
        """Up to `count` of the poses that are not of a batch, each the best after it and those before."""
        others = poses.subset(np.flatnonzero(~np.isin(poses.pose, batch.pose)))
        later = replace(self, information=self.information + batch.information(len(batch)))
        return later.ordered(others, min(count, len(others)))

    def moved(self, batch: OpenPoses) -> OpenPoses:
        """The batch with its poses moved to neighbours, round by round nearer ones, where that lets the whole batch tell more.

        A pose keeps the number of the candidate from which it was moved. Poses that must be candidates stay.
        """
        rng = np.random.default_rng(0)
        for share in _SHARES:
            q, beside = self.choice.neighbours(batch.q, _NEIGHBOURS, share, rng)
            if not len(q):
                break
            tried = batch.with_further(self.look(q, batch.pose[beside]))
            start = np.arange(len(batch))
            chosen = exchange(self._sensitivity(tried), len(batch), self._criterion, start=start).chosen
            batch = tried.subset(chosen.astype(int))
        return batch

    @property
    def _criterion(self) -> TraceOptimal:
        flat = self.working.reshape(-1, self.working.shape[2])
        return TraceOptimal(flat.T @ flat / len(self.working), "c")

    def _sensitivity(self, poses: OpenPoses) -> Sensitivity:
        items = Parameters(Parameter(f"parameter {k}", "1", 0.0) for k in range(len(self.information)))
        return Sensitivity(poses.columns, items, self.information)
