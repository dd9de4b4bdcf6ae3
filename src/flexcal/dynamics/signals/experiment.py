"""Filtered motions and torques of a recording over a window of time, as a regression takes them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexcal.dynamics.signals.motion import AT_REST, Motion

_STANDSTILL = 0.01
"""Share of its largest speed in the recording below which a joint stands still, as it does at rest."""


class Experiment(Protocol):
    """Recording that can be iterated repeatedly."""

    @property
    def name(self) -> str:
        """Name in messages."""
        ...

    @property
    def samples(self) -> int:
        """Number of samples."""
        ...

    @property
    def top_speed(self) -> np.ndarray:
        """Largest |q̇| of every joint (n,)."""
        ...

    @property
    def cutoff_hz(self) -> float:
        """Cut-off of the low-pass of its positions, infinite without one."""
        ...

    def blocks(self) -> Iterator[Motion]:
        """Motion in consecutive parts."""
        ...


@dataclass(frozen=True)
class Window:
    """Time window from `start` to before `end`, s on the recording's clock."""

    start: float = -math.inf
    end: float = math.inf


def slowest_speeds(experiment: Experiment) -> np.ndarray:
    """Speed (n,) up to which each joint stands still."""
    return np.maximum(_STANDSTILL * experiment.top_speed, AT_REST)
