"""The equations of one experiment, filtered and decimated, block by block (Eq. 2.26)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexcal.data.filtering import Decimation, DecimationStream
from flexcal.dynamics.motion import Motion
from flexcal.dynamics.observation import Observation

_BLOCK = 512
"""Samples, about, whose columns are in memory at once; they fit a processor's cache."""
_STANDSTILL = 0.01
"""A joint stands still below this share of its largest speed in the recording."""


class Experiment(Protocol):
    """One recording; it can be gone through again and again."""

    @property
    def name(self) -> str:
        """What messages call it."""
        ...

    @property
    def samples(self) -> int:
        """How many there are."""
        ...

    @property
    def top_speed(self) -> np.ndarray:
        """The largest |q̇| of every joint (n,)."""
        ...

    def blocks(self) -> Iterator[Motion]:
        """The motion in parts that follow each other."""
        ...


@dataclass(frozen=True)
class Window:
    """Rows from `start` to before `end`, s on the recording's clock."""

    start: float = -math.inf
    end: float = math.inf


@dataclass(frozen=True, eq=False)
class Rows:
    """M equations of every joint that follow each other.

    `systems` has for every joint W and, last, Y transposed (members + 1, M). `number` (M,) counts the rows of the experiment, whatever
    is left out; `time` (M,) is s, and `still` (M,) tells where no joint moves faster than a hundredth of its top speed.
    """

    number: np.ndarray
    time: np.ndarray
    still: np.ndarray
    systems: list[np.ndarray]

    def __len__(self) -> int:
        return len(self.number)

    @property
    def columns(self) -> list[np.ndarray]:
        """For every joint W transposed (members, M)."""
        return [system[:-1] for system in self.systems]

    @property
    def torque(self) -> np.ndarray:
        """Y of all joints (n, M)."""
        return np.array([system[-1] for system in self.systems])

    def where(self, keep: np.ndarray) -> Rows:
        """The rows that `keep` (M,) marks."""
        if keep.all():
            return self
        systems = [system[:, keep] for system in self.systems]
        return Rows(self.number[keep], self.time[keep], self.still[keep], systems)


def rows(
    observation: Observation, experiment: Experiment, decimation: Decimation, window: Window
) -> Iterator[Rows]:
    """The rows inside `window`: torques and every column of W through the same decimation, friction evaluated before it.

    Memory does not grow with the recording. A pass with the same arguments gives the same blocks again.
    """
    ends = np.cumsum(observation.widths)
    slowest = _STANDSTILL * experiment.top_speed
    stream = DecimationStream(decimation)
    centres = _Centres(decimation)
    reach = math.inf
    for start, piece in _pieces(experiment.blocks(), decimation.factor * max(1, _BLOCK // decimation.factor)):
        if len(piece) > 1:
            reach = (decimation.support + 1) * float(piece.time[1] - piece.time[0])
        if piece.time[-1] < window.start - reach:
            continue
        if piece.time[0] > window.end + reach:
            return
        still = np.asarray((np.abs(piece.dq) <= slowest).all(axis=1))
        centres.push(start, piece.time, still)
        systems = stream.push(observation.systems(piece))
        number, time, still = centres.pop(systems.shape[1])
        found = Rows(number, time, still, np.split(systems, ends[:-1]))
        inside = (time >= window.start) & (time < window.end)
        if inside.any():
            yield found.where(inside)


class _Centres:
    """Time and standstill of the samples that decimated rows stand for, until their rows are complete."""

    def __init__(self, decimation: Decimation) -> None:
        self._decimation = decimation
        self._next: int | None = None
        self._number = 0
        self._held = np.zeros((2, 0))

    def push(self, start: int, time: np.ndarray, still: np.ndarray) -> None:
        factor = self._decimation.factor
        if self._next is None:
            self._number = start // factor
            self._next = start + self._decimation.support
        at = np.arange(self._next, start + len(time), factor)
        self._next += factor * len(at)
        self._held = np.hstack([self._held, [time[at - start], still[at - start]]])

    def pop(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        (time, still), self._held = self._held[:, :count], self._held[:, count:]
        number = np.arange(self._number, self._number + count)
        self._number += count
        return number, time, still.astype(bool)


def _pieces(motions: Iterable[Motion], size: int) -> Iterator[tuple[int, Motion]]:
    """Parts of `size` samples (the last one shorter), each with the number of its first sample."""
    start, held = 0, None
    for motion in motions:
        whole = motion if held is None else Motion.joined([held, motion])
        full = len(whole) // size * size
        for first in range(0, full, size):
            yield start + first, whole.part(first, first + size)
        start += full
        held = whole.part(full, len(whole))
    if held is not None and len(held):
        yield start, held
