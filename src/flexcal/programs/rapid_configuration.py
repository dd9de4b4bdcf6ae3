"""Configuration data of ABB's six-joint arms: cf1, cf4, cf6 and cfx."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from flexcal.programs.configuration import Configuration


class QuadrantConfiguration(Configuration):
    """Quarter turns of axes 1, 4 and 6, counted from zero to -1 at small negative angles, and cfx from 0 to 7.

    cfx adds 4 where the wrist centre is behind axis 1, 2 where it is behind the lower arm, and 1 where axis 5 is negative
    (ABB: RAPID Instructions, Functions and Data types, confdata). Of the solutions with this cfx the controller takes the one whose axes
    are nearest to the quarter turns; programs often have a neighbouring one.
    """

    def levels(self, posture: np.ndarray) -> tuple[int, ...]:
        """As `Configuration.levels`: quarter turns, then behind axis 1, behind the lower arm, axis 5 negative."""
        quarters = [math.floor(posture[axis] / (np.pi / 2)) for axis in (0, 3, 5)]
        return (*quarters, int(posture[6] < 0), int(posture[7] < 0), int(posture[4] < 0))

    def read(self, words: Sequence[str]) -> tuple[int, ...] | None:
        """As `Configuration.read`."""
        values = [float(word.replace(" ", "")) for word in words]
        if not all(value.is_integer() and abs(value) < 100 for value in values) or not 0 <= values[3] <= 7:
            return None
        cf1, cf4, cf6, cfx = (int(value) for value in values)
        return cf1, cf4, cf6, cfx >> 2 & 1, cfx >> 1 & 1, cfx & 1

    def distance(self, posture: np.ndarray, words: Sequence[str]) -> float:
        """As `Configuration.distance`: the largest angle, rad, of axes 1, 4 and 6 from their quarter turns, a quarter turn at most."""
        written = self.read(words)
        if self.fits(posture, words) or written is None:
            return 0.0
        same = posture.copy()
        same[[0, 3, 5]] = (np.array(written[:3]) + 0.5) * (np.pi / 2)
        away = float(np.abs(posture[[0, 3, 5]] - same[[0, 3, 5]]).max()) - np.pi / 4
        return away if self.fits(same, words) and away <= np.pi / 2 else np.inf

    def words(self, levels: Sequence[int], old: Sequence[str]) -> tuple[str, ...]:
        """As `Configuration.words`."""
        cf1, cf4, cf6, behind, below, negative = levels
        new = (cf1, cf4, cf6, 4 * behind + 2 * below + negative)
        return tuple(
            word if float(word.replace(" ", "")) == value else str(value)
            for word, value in zip(old, new, strict=True)
        )
