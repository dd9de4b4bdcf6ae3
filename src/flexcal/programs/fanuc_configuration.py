"""Configuration data of Fanuc's controllers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from flexcal.programs.configuration import Configuration

_LETTERS = ("NF", "DU", "BT")
"""Wrist: axis 5 below zero (no flip) or above (flip); elbow down or up; wrist centre behind axis 1 (B) or in front (T)."""
_WRIST, _FRONT, _ELBOW = 4, 6, 7


class FanucConfiguration(Configuration):
    """CONFIG : 'N U T, 0, 0, 0'.

    Source: FANUC Robot series, Operator's Manual, "Configuration". Which axes the three turn numbers belong to is set at the controller
    ($SCR_GRP[1].$TURN_AXIS), so they are kept and tell nothing here: a whole turn does not move the tool. Straight motions keep the
    configuration that they start in.
    """

    on_lines: ClassVar[bool] = False

    def levels(self, posture: np.ndarray) -> tuple[int, ...]:
        """As `Configuration.levels`."""
        return (int(posture[_WRIST] >= 0), int(posture[_ELBOW] >= 0), int(posture[_FRONT] >= 0))

    def read(self, words: Sequence[str]) -> tuple[int, ...] | None:
        """As `Configuration.read`."""
        letters = [word.upper() for word in words[:3]]
        known = all(letter in pair for letter, pair in zip(letters, _LETTERS, strict=False))
        if len(letters) < 3 or not known:
            return None
        return tuple(pair.index(letter) for letter, pair in zip(letters, _LETTERS, strict=True))

    def words(self, levels: Sequence[int], old: Sequence[str]) -> tuple[str, ...]:
        """As `Configuration.words`."""
        new = [pair[level] for level, pair in zip(levels, _LETTERS, strict=True)]
        return (*new, *old[3:])
