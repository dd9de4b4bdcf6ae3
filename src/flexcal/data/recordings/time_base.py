"""Uniform time base for measured time stamps, on which values are interpolated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import floor

import numpy as np

from flexcal.data.recordings.irregular_interpolation import interpolated
from flexcal.data.recordings.sample_times import GAP, JITTER, Clock, Samples, clock_of, in_order, merged
from flexcal.errors import FlexcalError

ENOUGH = 200
"""Least number of samples, if available, for the clock of blocks."""
_REACH = 5.0
"""Largest number of longest steps that the interpolation reaches to either side."""
_ROUNDING = 1e-6
"""Time steps by which the last sample may lie before its place on the base."""
_BLOCK = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class TimeBase:
    """Uniform time base t = start + k · time_step (s, k < samples) under time stamps, and the deviations from it.

    jitter: standard deviation of the time stamps about the base, s; jitter_max: the largest deviation.
    shortest, longest: steps between time stamps, s. even: samples were taken evenly, and only their stamps scatter.
    lost: samples that are missing and filled in by interpolation, of a log with a uniform base; regular: whether it has one.
    resampled: whether values are interpolated onto the base, or taken as they are since the stamps fit within 2 %.
    gap: seconds without samples before the start, where the log has a gap there.
    sorted, merged, repeated: rows that were out of order, had the time stamp of another one, or repeated the row before while the robot
        went on; these are left out.
    """

    start: float
    time_step: float
    samples: int
    jitter: float
    jitter_max: float
    lost: int
    resampled: bool
    gap: float = 0.0
    shortest: float = 0.0
    longest: float = 0.0
    regular: bool = True
    even: bool = False
    sorted: int = 0
    merged: int = 0
    repeated: int = 0


def sampling_gaps(t: np.ndarray, longest: float | None = None) -> np.ndarray:
    """Indices i where a gap lies between t[i] and t[i + 1]: a step of more than `longest` (s; None: 2.5 median steps)."""
    steps = np.diff(t)
    if not steps.size:
        return np.zeros(0, dtype=int)
    return np.flatnonzero(steps > (GAP * np.median(steps) if longest is None else longest))


def uniform_blocks(
    blocks: Iterable[_BLOCK], *, positions: int = 0, fill: float = 0.0
) -> Iterator[tuple[TimeBase, np.ndarray]]:
    """Blocks of time stamps (N,) with values (N, m), put on one uniform base as they come; the first `positions` columns are positions.

    Clock and time step are those of the longest stretch of the first block (of at least 200 samples). Time stamps are taken as the times
    of their samples, unless the positions are those of even sampling. A stretch ends at a gap: a step of more than 2.5 time steps and more
    than `fill` (s). Inside one, values are interpolated, and nothing is extrapolated; the next one has a base of its own, whose `gap` says
    how long it was. A block may hold back its last samples for the next. Raises `FlexcalError` for fewer than two samples in all.
    """
    clock: Clock | None = None
    even: _EvenTimes | None = None
    stretch, repairs = _Stretch(), np.zeros(3, dtype=int)
    pending = Samples(np.zeros(0), np.zeros((0, 0)))
    for t, values, last in _with_last(blocks):
        new = Samples(t, values)
        if clock is None:
            new = pending = _joined(pending, new)
            if new.t.size < ENOUGH and not last:
                continue
        new = in_order(new.t, new.values, positions)
        repairs += new.repairs
        if clock is None:
            if new.t.size < 2:
                raise FlexcalError("E-LOG-022", "a recording needs at least two samples.")
            clock = clock_of(new.t, new.values[:, :positions], fill)
            even = _EvenTimes(clock) if clock.even else None
            pending = Samples(np.zeros(0), new.values[:0])
        if even is not None:
            new = _joined(pending, Samples(even.times(new.t), new.values))
        else:
            new = _joined(pending, new)
            new = merged(in_order(new.t, new.values, 0))
            repairs += new.repairs
        t, values = new.t, new.values
        edges = [0, *(sampling_gaps(t, clock.gap) + 1), t.size]
        for first, end in pairwise(edges):
            completed = stretch.push(t[first:end], values[first:end], clock, whole=last or end < t.size)
            if completed is not None:
                base, part = completed
                ordered, alike, repeated = (int(count) for count in repairs)
                yield replace(base, sorted=ordered, merged=alike, repeated=repeated), part
                repairs[:] = 0
            if end < t.size:
                stretch = _Stretch(gap=float(t[end] - t[end - 1]))
        kept = edges[-2]
        if stretch.begun:
            kept += int(np.searchsorted(t[kept:], stretch.next - _REACH * clock.gap))
        pending = Samples(t[kept:], values[kept:])


def _joined(pending: Samples, new: Samples) -> Samples:
    if not pending.t.size:
        return new
    return Samples(np.concatenate([pending.t, new.t]), np.concatenate([pending.values, new.values]))


def _with_last(blocks: Iterable[_BLOCK]) -> Iterator[tuple[np.ndarray, np.ndarray, bool]]:
    iterator = iter(blocks)
    current = next(iterator, None)
    while current is not None:
        following = next(iterator, None)
        yield (*current, following is None)
        current = following


class _EvenTimes:
    """Times of uniformly sampled values from scattered time stamps, followed from block to block."""

    def __init__(self, clock: Clock) -> None:
        self._step, self._gap = clock.time_step, clock.gap
        self._origin, self._number, self._shift = 0.0, 0, 0.0
        self._last: float | None = None

    def times(self, t: np.ndarray) -> np.ndarray:
        """Times of the next samples, with the stamps `t` (N,)."""
        starts = sampling_gaps(t, self._gap) + 1
        if t.size and (self._last is None or t[0] - self._last > self._gap):
            starts = np.concatenate([[0], starts])
        edges = np.unique([0, *starts, t.size])
        runs = [self._run(t[a:b], fresh=bool(np.isin(a, starts))) for a, b in pairwise(edges)]
        self._last = float(t[-1]) if t.size else self._last
        return np.concatenate([np.zeros(0), *runs])

    def _run(self, t: np.ndarray, *, fresh: bool) -> np.ndarray:
        if fresh:
            self._origin = float(np.mean(t - self._step * np.arange(t.size)))
            self._number, self._shift = 0, 0.0
        even = self._origin + self._step * (self._number + np.arange(t.size))
        before = self._shift
        if not fresh and t.size >= ENOUGH:
            most = 0.5 * self._step * t.size
            self._shift = before + float(np.clip(np.median(t - even) - before, -most, most))
        self._number += t.size
        return even + np.linspace(before, self._shift, t.size)


class _Stretch:
    """Samples without gaps, put on a base that goes on from block to block; `gap` (s) precedes them."""

    def __init__(self, gap: float = 0.0) -> None:
        self._gap = gap
        self._start, self._done, self._step = 0.0, 0, 1.0

    @property
    def begun(self) -> bool:
        """Whether there are samples on the base."""
        return self._done > 0

    @property
    def next(self) -> float:
        """Time of the next sample on the base, s."""
        return self._start + self._done * self._step

    def push(
        self, t: np.ndarray, values: np.ndarray, clock: Clock, *, whole: bool
    ) -> tuple[TimeBase, np.ndarray] | None:
        """Part of the base completed by samples at `t` (N,), if any: all that they enclose if the stretch ends with them."""
        step = clock.time_step
        start = self.next if self.begun else _start(t, step)
        enclosed = (float(t[-1]) - start) / step
        count = floor(enclosed + 0.5) + 1 if whole else floor(enclosed - _REACH * clock.gap / step)
        if count <= 0:
            return None
        number = np.rint((t - start) / step)
        inside = (number >= 0) & (number < count)
        deviation = (t - start - step * number)[inside]
        largest = float(np.abs(deviation).max()) if deviation.size else 0.0
        taken = (
            deviation.size == count
            and bool((np.diff(number[inside]) == 1).all())
            and largest <= JITTER * step
        )
        if taken:
            part = values[inside]
        else:
            start = start if self.begun else float(t[0])
            count = floor((float(t[-1]) - start) / step + _ROUNDING) + 1 if whole else count
            if count <= 0:
                return None
            part = interpolated(t, values, np.clip(start + step * np.arange(count), t[0], t[-1]))
        if not self.begun:
            self._start, self._step = start, step
        self._done += count
        steps = np.diff(t)
        base = TimeBase(
            start,
            step,
            count,
            float(deviation.std()) if deviation.size else 0.0,
            largest,
            max(0, count - int(inside.sum())) if clock.regular else 0,
            not taken,
            gap=self._gap,
            shortest=float(steps.min()) if steps.size else step,
            longest=float(steps.max()) if steps.size else step,
            regular=clock.regular,
            even=clock.even,
        )
        self._gap = 0.0
        return base, part


def _start(t: np.ndarray, step: float) -> float:
    """Start of the base under stamps that lie next to it; else the first stamp."""
    number = np.rint((t - t[0]) / step)
    start = float(t[0] + np.mean(t - t[0] - step * number))
    return float(t[0]) if abs(start - t[0]) < 1e-6 * step else start
