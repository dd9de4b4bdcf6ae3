"""Motion on the arm side of elastic joints, beside that of the motors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class ArmSide:
    """`q`, `dq`, `ddq` (N, n) in rad, m and s, of all joints; where a joint is rigid nobody looks at them."""

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray

    def part(self, start: int, stop: int) -> ArmSide:
        """Samples from `start` to before `stop`."""
        at = slice(start, stop)
        return ArmSide(self.q[at], self.dq[at], self.ddq[at])

    @classmethod
    def joined(cls, parts: Sequence[ArmSide | None]) -> ArmSide | None:
        """Parts that follow each other as one; None where any is missing."""
        known = [part for part in parts if part is not None]
        if len(known) < len(parts):
            return None
        return cls(
            *(np.concatenate(column) for column in zip(*((p.q, p.dq, p.ddq) for p in known), strict=True))
        )
