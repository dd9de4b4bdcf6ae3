"""A recording as the identification of dynamics needs it: filtered positions, velocities, accelerations, torques."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from flexcal.data import Recording
from flexcal.data.low_pass import LowPass

_BORDER_PERIODS = 1.0
"""What is cut from either end, in periods of the cut-off."""


@dataclass(frozen=True, eq=False)
class Motion:
    """`q`, `dq`, `ddq` (N, n) in rad, m and s, the motor `torque` (N, n) referred to the joint, at `time` (N,), s."""

    time: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    torque: np.ndarray

    def __len__(self) -> int:
        return len(self.time)

    @property
    def name(self) -> str:
        """What messages call it."""
        return "the motion"

    @property
    def samples(self) -> int:
        """Of the whole experiment: this motion is all of it."""
        return len(self)

    @property
    def top_speed(self) -> np.ndarray:
        """The largest |q̇| of every joint (n,)."""
        return np.abs(self.dq).max(axis=0)

    def blocks(self) -> Iterator[Motion]:
        """The experiment in parts that follow each other: here one."""
        yield self

    def part(self, start: int, stop: int) -> Motion:
        """Samples from `start` to before `stop`."""
        at = slice(start, stop)
        return Motion(self.time[at], self.q[at], self.dq[at], self.ddq[at], self.torque[at])

    @classmethod
    def joined(cls, parts: Iterable[Motion]) -> Motion:
        """Motions that follow each other as one."""
        columns = zip(*((m.time, m.q, m.dq, m.ddq, m.torque) for m in parts), strict=True)
        return cls(*(np.concatenate(column) for column in columns))

    @classmethod
    def of(cls, recording: Recording, cutoff_hz: float) -> Motion:
        """All of a recording as `filtered_motion` gives it; raises `FlexcalError` as that does."""
        return cls.joined(filtered_motion([recording], cutoff_hz))


@dataclass(frozen=True, eq=False)
class FilteredPositions:
    """N samples from `start` (s) on, `time_step` (s) apart: `torque` (N, n), and `q` (N + 4, n), which begins two samples before."""

    start: float
    time_step: float
    q: np.ndarray
    torque: np.ndarray

    def __len__(self) -> int:
        return len(self.torque)

    def part(self, start: int, stop: int) -> FilteredPositions:
        """Samples from `start` to before `stop`."""
        time = self.start + start * self.time_step
        return FilteredPositions(time, self.time_step, self.q[start : stop + 4], self.torque[start:stop])

    def motion(self) -> Motion:
        """With velocities and accelerations by central differences."""
        dq = (self.q[2:] - self.q[:-2]) / (2 * self.time_step)
        ddq = (dq[2:] - dq[:-2]) / (2 * self.time_step)
        time = self.start + self.time_step * np.arange(len(self))
        return Motion(time, self.q[2:-2], dq[1:-1], ddq, self.torque)


def filtered_motion(recordings: Iterable[Recording], cutoff_hz: float) -> Iterator[Motion]:
    """The motions of `filtered_positions`; raises `FlexcalError` as that does."""
    return (part.motion() for part in filtered_positions(recordings, cutoff_hz))


def filtered_positions(recordings: Iterable[Recording], cutoff_hz: float) -> Iterator[FilteredPositions]:
    """Positions through a zero-phase low-pass; the torque as measured.

    `recordings` follow each other without a seam, as blocks of one log; so do the parts, and they do not depend on where the blocks
    are cut. Samples nearer to an end than one period of the cut-off are removed. Raises `FlexcalError` as `LowPass` does, and where all
    the samples are too few for it.
    """
    first, recordings = _peeked(recordings)
    step, n = first.time_step, first.q.shape[1]
    low_pass = LowPass(step, cutoff_hz)
    border = int(np.ceil(_BORDER_PERIODS / (cutoff_hz * step)))
    samples, number = 0, 2
    held = np.zeros((0, 2 * n))
    for values, own in _extended(recordings, low_pass):
        samples += own
        held = np.concatenate([held, values])
        q = low_pass.apply(held[:, :n])
        if len(q) < 5:
            continue
        torque = held[low_pass.support + 2 :, n:][: len(q) - 4]
        found = FilteredPositions(first.start + step * number, step, q, torque)
        last = samples - border - number if own == 0 else len(found)
        begin = min(max(0, border - number), len(found))
        yield found.part(begin, max(begin, last))
        number += len(found)
        held = held[len(found) :]


def _peeked(recordings: Iterable[Recording]) -> tuple[Recording, Iterator[Recording]]:
    iterator = iter(recordings)
    first = next(iterator)
    return first, chain([first], iterator)


def _extended(recordings: Iterable[Recording], low_pass: LowPass) -> Iterator[tuple[np.ndarray, int]]:
    """Positions and torques side by side, with what the filter needs before and after them, and how many samples are measured ones."""
    begun = False
    end = np.zeros((0, 0))
    for recording in recordings:
        values = np.hstack([recording.q, recording.torque])
        end = np.concatenate([end, values]) if end.size else values
        if begun:
            yield values, len(values)
        elif len(end) > low_pass.support:
            begun = True
            yield np.concatenate([low_pass.before(end), end]), len(end)
        if begun:
            end = end[-low_pass.support - 1 :]
    yield low_pass.before(end[::-1])[::-1], 0
