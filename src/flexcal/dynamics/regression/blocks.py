"""Equations of one experiment, filtered and decimated, block by block (Eq. 2.26)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.data.recordings import Decimation, DecimationStream
from flexcal.dynamics.inverse_model import Equations, Memory
from flexcal.dynamics.signals import Experiment, Motion, Window, slowest_speeds, stretches

_BLOCK = 2300
"""Approximate number of samples whose columns are in memory at once, some three megabytes: with fewer, what is done once a block weighs
more than the cache gains. Not a power of two, which would use little of it.
"""


@dataclass(frozen=True, eq=False)
class RegressionBlock:
    """Block of M consecutive equations of every kind (of each joint, and of motors alone).

    `reduced` has for every kind the reduced columns of W and, last, Y transposed (·, M), and `projection` what gives W back, as an
    `Observation` has them. `number` (M,) counts the rows of the experiment, whatever is left out; `time` (M,) is s, and `still` (M,)
    tells where the robot stands still within a row: no joint is faster than a hundredth of its top speed.
    """

    number: np.ndarray
    time: np.ndarray
    still: np.ndarray
    reduced: list[np.ndarray]
    projection: tuple[np.ndarray, ...]

    def __len__(self) -> int:
        return len(self.number)

    @property
    def columns(self) -> list[np.ndarray]:
        """Transposed W (columns, M) of every kind."""
        return [
            projection.T @ own[:-1] for projection, own in zip(self.projection, self.reduced, strict=True)
        ]

    @property
    def torque(self) -> np.ndarray:
        """Torque Y (·, M) of all kinds."""
        return np.array([own[-1] for own in self.reduced])

    def predicted(self, column_indices: Sequence[np.ndarray], parameters: np.ndarray) -> np.ndarray:
        """Predicted torque W χ (·, M) of all kinds for `parameters` (p,), with `column_indices` the numbers of each kind's own."""
        equations = zip(column_indices, self.projection, self.reduced, strict=True)
        return np.array([(projection @ parameters[felt]) @ own[:-1] for felt, projection, own in equations])

    def where(self, keep: np.ndarray) -> RegressionBlock:
        """Rows of the mask `keep` (M,); those that follow each other share their memory with these."""
        if keep.all():
            return self
        rows = np.flatnonzero(keep)
        if len(rows) and rows[-1] - rows[0] == len(rows) - 1:
            run = slice(rows[0], rows[-1] + 1)
            reduced = [own[:, run] for own in self.reduced]
        else:
            reduced = [own.take(rows, axis=1) for own in self.reduced]
        return RegressionBlock(self.number[keep], self.time[keep], self.still[keep], reduced, self.projection)

    def weighted(self, weights: np.ndarray) -> RegressionBlock:
        """Rows of every kind times the root of their `weights` (·, M)."""
        reduced = [own * root for own, root in zip(self.reduced, np.sqrt(weights), strict=True)]
        return RegressionBlock(self.number, self.time, self.still, reduced, self.projection)


def regression_blocks(
    observation: Equations, experiment: Experiment, decimation: Decimation, window: Window
) -> Iterator[RegressionBlock]:
    """Rows inside `window`: torques and every column of W through the same decimation, friction evaluated before it.

    No row reaches across a gap of the experiment. Memory does not grow with the recording. A pass with the same arguments gives the same
    blocks again.
    """
    memory: Memory = {}
    slowest = slowest_speeds(experiment)
    done = 0

    def counted(motions: Iterable[Motion]) -> Iterator[Motion]:
        nonlocal done
        for motion in motions:
            done += len(motion)
            yield motion

    for stretch in stretches(experiment.blocks()):
        first = -(-done // decimation.factor)
        yield from _stretch_rows(observation, counted(stretch), slowest, decimation, window, memory, first)


def _stretch_rows(
    observation: Equations,
    motions: Iterable[Motion],
    slowest: np.ndarray,
    decimation: Decimation,
    window: Window,
    memory: Memory,
    first: int,
) -> Iterator[RegressionBlock]:
    """Rows of motions without gaps, from the number `first` on; friction keeps its state."""
    ends = np.cumsum(observation.widths)
    stream = DecimationStream(decimation)
    centres = _Centres(decimation, first)
    reach = math.inf
    for start, piece in _pieces(motions, decimation.factor * max(1, _BLOCK // decimation.factor)):
        if len(piece) > 1:
            reach = (decimation.support + 1) * float(piece.time[1] - piece.time[0])
        if piece.time[-1] < window.start - reach:
            observation.follow(piece, memory)
            continue
        if piece.time[0] > window.end + reach:
            return
        still = np.asarray((np.abs(piece.dq) <= slowest).all(axis=1))
        centres.push(start, piece.time, still)
        reduced = stream.push(observation.reduced(piece, memory))
        number, time, still = centres.pop(reduced.shape[1])
        block = RegressionBlock(number, time, still, np.split(reduced, ends[:-1]), observation.projection)
        inside = (time >= window.start) & (time < window.end)
        if inside.any():
            yield block.where(inside)


class _Centres:
    """Times and standstill of the samples at the centres of decimated rows, until their rows are complete.

    A row stands still where the robot does anywhere in the main lobe of its filter, one row to either side: what friction is at rest, no
    sign of a velocity tells, and the row holds a part of it.
    """

    def __init__(self, decimation: Decimation, number: int) -> None:
        self._decimation = decimation
        self._start = number
        self._number: int | None = None
        self._first = decimation.support
        self._pending = np.zeros((2, 0))

    def push(self, start: int, time: np.ndarray, still: np.ndarray) -> None:
        if self._number is None:
            self._number = self._start + start // self._decimation.factor
        self._pending = np.hstack([self._pending, [time, still]])

    def pop(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        factor, size = self._decimation.factor, self._pending.shape[1]
        centres = self._first + factor * np.arange(count)
        time, still = self._pending
        before = np.concatenate([[0.0], np.cumsum(still)])
        low, high = np.maximum(centres - factor + 1, 0), np.minimum(centres + factor, size)
        number = (self._number or 0) + np.arange(count)
        self._number = (self._number or 0) + count
        spent = min(size, max(0, self._first + factor * (count - 1)))
        self._pending, self._first = self._pending[:, spent:], self._first + factor * count - spent
        return number, time[centres], before[high] > before[low]


def _pieces(motions: Iterable[Motion], size: int) -> Iterator[tuple[int, Motion]]:
    """Pieces of `size` samples (the last one shorter), each with the number of its first sample."""
    start, pending = 0, None
    for motion in motions:
        whole = motion if pending is None else Motion.joined([pending, motion])
        full = len(whole) // size * size
        for first in range(0, full, size):
            yield start + first, whole.part(first, first + size)
        start += full
        pending = whole.part(full, len(whole))
    if pending is not None and len(pending):
        yield start, pending
