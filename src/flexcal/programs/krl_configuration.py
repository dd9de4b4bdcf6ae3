"""Configuration data of KUKA's six-joint arms: status S and turn T."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from flexcal.programs.configuration import Configuration


class StatusAndTurn(Configuration):
    """Bits of S: wrist centre behind axis 1 (1), in front of the stretched arm (2), axis 5 negative (4); of T: axis i negative (2^(i-1)).

    As KUKA's operating instructions have them. Further bits of S, as 16 for an absolutely accurate robot, stay. A straight motion
    keeps the configuration that it starts in, whatever S and T say, and within 2° of zero the controller ignores the turn of an axis.
    """

    on_lines: ClassVar[bool] = False

    def levels(self, posture: np.ndarray) -> tuple[int, ...]:
        """As `Configuration.levels`: three bits of S, then six of T, the lowest first."""
        return (
            int(posture[6] < 0),
            int(posture[7] > 0),
            int(posture[4] < 0),
            *(int(angle < 0) for angle in posture[:6]),
        )

    def read(self, words: Sequence[str]) -> tuple[int, ...] | None:
        """As `Configuration.read`."""
        status, turn = (_value(word) for word in words)
        if status is None or turn is None:
            return None
        return (*(status >> bit & 1 for bit in range(3)), *(turn >> bit & 1 for bit in range(6)))

    def distance(self, posture: np.ndarray, words: Sequence[str]) -> float:
        """As `Configuration.distance`: the largest angle, rad, of an axis whose turn is ignored."""
        written = self.read(words)
        if self.fits(posture, words) or written is None:
            return 0.0
        signs = 1 - 2 * np.array(written[3:])
        wrong = np.maximum(-signs * posture[:6], 0.0)
        same_status = self.levels(posture)[:3] == written[:3]
        return float(wrong.max()) if same_status and wrong.max() < _IGNORED else np.inf

    def words(self, levels: Sequence[int], old: Sequence[str]) -> tuple[str, ...]:
        """As `Configuration.words`."""
        new = []
        for word, bits in zip(old, (levels[:3], levels[3:]), strict=True):
            before = _value(word) or 0
            value = before >> len(bits) << len(bits) | sum(bit << k for k, bit in enumerate(bits))
            binary = word.strip("'").lower().startswith("b")
            text = f"'B{value:0{len(word) - 3}b}'" if binary else str(value)
            new.append(word if value == before else text)
        return tuple(new)


_IGNORED = np.deg2rad(2.0)
"""Joint position, rad, below which the turn of an axis does not count."""


def _value(word: str) -> int | None:
    """Value of an integer, or of bits as 'B0110' or 'H3F'."""
    text = word.strip("'").lower()
    try:
        if text[:1] in ("b", "h"):
            return int(text[1:], 2 if text[0] == "b" else 16)
        number = float(text)
    except ValueError:
        return None
    return int(number) if number.is_integer() and number >= 0 else None
