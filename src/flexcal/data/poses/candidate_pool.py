"""Candidate poses from a file."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.errors import FlexcalError


@dataclass(frozen=True, eq=False)
class PosePool:
    """N feasible poses: `q` (N, n) rad, their numbers `pose` (N,), and the `payload` (kg) held in all of them; None as declared.

    They may have been drawn from `among` poses. Raises `FlexcalError` where shapes do not fit or a number stands twice.
    """

    q: np.ndarray
    pose: np.ndarray
    payload: float | None = None
    among: int | None = None

    def __post_init__(self) -> None:
        if self.q.ndim != 2 or self.pose.shape != self.q.shape[:1]:
            raise FlexcalError(
                "E-POSES-001",
                f"a pool of {self.pose.size} poses has joint positions of shape {self.q.shape}.",
            )
        if np.unique(self.pose).size < self.pose.size:
            raise FlexcalError("E-POSES-002", "a pool holds every pose once; give every pose its own number.")

    def __len__(self) -> int:
        return len(self.q)

    def subset(self, rows: np.ndarray) -> PosePool:
        """Poses with these indices or of this mask, in their order."""
        return replace(self, q=self.q[rows], pose=self.pose[rows])

    def drawn(self, most: int) -> PosePool:
        """Random subset of at most so many poses, the same at every call, in their order."""
        if len(self) <= most:
            return self
        rows = np.sort(np.random.default_rng(0).choice(len(self), most, replace=False))
        return replace(self.subset(rows), among=len(self))
