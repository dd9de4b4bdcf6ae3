"""Motion on the arm side of elastic joints, beside that of the motors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class ArmSide:
    """Arm-side motion `q`, `dq`, `ddq` (N, n) in rad, m and s, of all joints; values of rigid joints are not used.

    `tilts` are the tilts of the bearings about x and about y, each with its derivatives, where they were measured.
    """

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    tilts: tuple[ArmSide, ArmSide] | None = None

    def part(self, start: int, stop: int) -> ArmSide:
        """Samples from `start` to before `stop`."""
        at = slice(start, stop)
        tilts = None
        if self.tilts is not None:
            tilts = self.tilts[0].part(start, stop), self.tilts[1].part(start, stop)
        return ArmSide(self.q[at], self.dq[at], self.ddq[at], tilts)

    @classmethod
    def joined(cls, parts: Sequence[ArmSide | None]) -> ArmSide | None:
        """Concatenation of consecutive parts; None if any is missing."""
        known = [part for part in parts if part is not None]
        if len(known) < len(parts):
            return None
        q, dq, ddq = (np.concatenate([getattr(p, key) for p in known]) for key in ("q", "dq", "ddq"))
        about = [cls.joined([None if p.tilts is None else p.tilts[k] for p in known]) for k in range(2)]
        tilts = None if about[0] is None or about[1] is None else (about[0], about[1])
        return cls(q, dq, ddq, tilts)
