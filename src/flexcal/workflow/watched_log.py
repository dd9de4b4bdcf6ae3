"""A log that says how much of it has been gone through."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics import JointLog, Motion
from flexcal.progress import Progress


@dataclass(frozen=True, eq=False)
class WatchedLog:
    """A `log` that tells `progress` of every pass over it, under the name `stage`."""

    log: JointLog
    stage: str
    progress: Progress

    @property
    def name(self) -> str:
        """That of the log."""
        return self.log.name

    @property
    def samples(self) -> int:
        """Those of the log."""
        return self.log.samples

    @property
    def top_speed(self) -> np.ndarray:
        """Those of the log (n,)."""
        return self.log.top_speed

    def blocks(self) -> Iterator[Motion]:
        """The motion in parts that follow each other."""
        seen = 0
        for motion in self.log.blocks():
            yield motion
            seen += len(motion)
            self.progress(self.stage, min(1.0, seen / max(1, self.samples)))


def onward(progress: Progress, number: int, parts: int) -> Progress:
    """Tells how much of all `parts` is done from how much of that `number` is."""
    return lambda stage, share: progress(stage, (number + share) / parts)
