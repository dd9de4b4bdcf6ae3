"""Filtered motions and torques of a recording over a window of time, as a regression takes them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexcal.dynamics.signals.motion import AT_REST, Motion

_STANDSTILL = 0.01
"""A joint stands still below this share of its largest speed in the recording, and where it is at rest."""


class Experiment(Protocol):
    """One recording; it can be gone through again and again."""

    @property
    def name(self) -> str:
        """Name in messages."""
        ...

    @property
    def samples(self) -> int:
        """How many there are."""
        ...

    @property
    def top_speed(self) -> np.ndarray:
        """The largest |q̇| of every joint (n,)."""
        ...

    @property
    def cutoff_hz(self) -> float:
        """Of the low-pass that its positions went through, infinite where they went through none."""
        ...

    def blocks(self) -> Iterator[Motion]:
        """The motion in parts that follow each other."""
        ...


@dataclass(frozen=True)
class Window:
    """Rows from `start` to before `end`, s on the recording's clock."""

    start: float = -math.inf
    end: float = math.inf


def slowest_speeds(experiment: Experiment) -> np.ndarray:
    """Speed (n,) up to which each joint stands still."""
    return np.maximum(_STANDSTILL * experiment.top_speed, AT_REST)
