"""Sources of measurements."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol, runtime_checkable

from flexcal.data.plans import MultisinePlan, PosePlan, TrajectoryPlan
from flexcal.data.poses import PoseSet
from flexcal.data.recordings import Recording


@runtime_checkable
class Cell(Protocol):
    """A robot with its instruments: simulated, or a folder of recorded files."""

    def record(self, plan: MultisinePlan | TrajectoryPlan) -> Iterator[Recording]:
        """Recordings of the plan one by one, in its order, labelled; none has to stay in memory."""
        ...

    def measure(self, plan: PosePlan) -> PoseSet:
        """Measured poses of the plan."""
        ...
