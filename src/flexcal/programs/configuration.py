"""Configuration data of a dialect: which solution of inverse kinematics a pose means."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

_NEAR = 2e-3
"""Change of a quantity (rad, m) within which the controller may count it on the other side of a step."""
_SAME = 1e-7
"""Change of a quantity (rad, m) that is only rounding."""


class Configuration(ABC):
    """Configuration data as step functions of the posture.

    A posture is eight quantities (8,): the six joint positions of the controller, rad; how far the wrist centre is in front of axis 1, m;
    and how far it is in front of the lower arm, the line from axis 2 to axis 3, m: positive where a positive rotation of axis 3 from the
    stretched arm brings it, if axes 2 and 3 have one direction. Negative values lie behind. `on_lines`: whether the controller heeds the
    data in straight motions; otherwise these keep the configuration that they start in.
    """

    on_lines: ClassVar[bool] = True

    @abstractmethod
    def levels(self, posture: np.ndarray) -> tuple[int, ...]:
        """Levels of a posture; each is a monotone step function of one of its quantities."""

    @abstractmethod
    def read(self, words: Sequence[str]) -> tuple[int, ...] | None:
        """Levels that the words mean; None where they mean no configuration."""

    @abstractmethod
    def words(self, levels: Sequence[int], old: Sequence[str]) -> tuple[str, ...]:
        """Words of the levels, in place of the words `old`."""

    def fits(self, posture: np.ndarray, words: Sequence[str]) -> bool:
        """Whether a posture has the written configuration; next to a step both sides do."""
        return self._within(posture, words, _NEAR)

    def distance(self, posture: np.ndarray, words: Sequence[str]) -> float:
        """How far a posture is from the written configuration: 0 where it has it, infinite where the controller does not take it for that.

        Of several solutions the controller takes the nearest one.
        """
        return 0.0 if self.fits(posture, words) else np.inf

    def updated(self, posture: np.ndarray, words: Sequence[str]) -> tuple[str, ...]:
        """Words of a posture; the old ones where they hold."""
        if self._within(posture, words, _SAME):
            return tuple(words)
        return self.words(self.levels(posture + _SAME), words)

    def _within(self, posture: np.ndarray, words: Sequence[str], tolerance: float) -> bool:
        written = self.read(words)
        if written is None:
            return True
        ends = self.levels(posture - tolerance), self.levels(posture + tolerance)
        return all(
            min(one, other) <= level <= max(one, other)
            for level, one, other in zip(written, *ends, strict=True)
        )
