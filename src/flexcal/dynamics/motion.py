"""A recording as the identification of dynamics needs it: filtered positions, velocities, accelerations, torques."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Literal

import numpy as np

from flexcal.data import Recording
from flexcal.data.low_pass import LowPass
from flexcal.dynamics.arm_side import ArmSide

TorqueLog = Literal["held", "instantaneous", "mean"]
"""What a logged torque is over its sample."""

_BORDER_PERIODS = 1.0
"""What is cut from either end, in periods of the cut-off."""


@dataclass(frozen=True, eq=False)
class Motion:
    """`q`, `dq`, `ddq` (N, n) in rad, m and s, the motor `torque` (N, n) referred to the joint, at `time` (N,), s.

    Positions are the motors', referred to the joint; `arm` has those behind elastic drives, where they were measured.
    """

    time: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    torque: np.ndarray
    arm: ArmSide | None = None

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
        arm = None if self.arm is None else self.arm.part(start, stop)
        return Motion(self.time[at], self.q[at], self.dq[at], self.ddq[at], self.torque[at], arm)

    @classmethod
    def joined(cls, parts: Iterable[Motion]) -> Motion:
        """Motions that follow each other as one."""
        held = list(parts)
        columns = zip(*((m.time, m.q, m.dq, m.ddq, m.torque) for m in held), strict=True)
        return cls(*(np.concatenate(column) for column in columns), arm=ArmSide.joined([m.arm for m in held]))

    @classmethod
    def of(cls, recording: Recording, cutoff_hz: float, torque: TorqueLog = "instantaneous") -> Motion:
        """All of a recording as `filtered_motion` gives it; raises `FlexcalError` as that does."""
        return cls.joined(filtered_motion([recording], cutoff_hz, torque))


@dataclass(frozen=True, eq=False)
class FilteredPositions:
    """N samples from `start` (s) on, `time_step` (s) apart: `torque` (N, n), and `q` (N + 4, n), which begins two samples before.

    Where the arm side was measured too, its positions follow those of the motors: `q` (N + 4, 2 n).
    """

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
        n = self.torque.shape[1]
        q, dq = self.q[2:-2], dq[1:-1]
        arm = ArmSide(q[:, n:], dq[:, n:], ddq[:, n:]) if q.shape[1] > n else None
        return Motion(time, q[:, :n], dq[:, :n], ddq[:, :n], self.torque, arm)


def filtered_motion(
    recordings: Iterable[Recording], cutoff_hz: float, torque: TorqueLog = "instantaneous"
) -> Iterator[Motion]:
    """The motions of `filtered_positions`; raises `FlexcalError` as that does."""
    return (part.motion() for part in filtered_positions(recordings, cutoff_hz, torque))


def filtered_positions(
    recordings: Iterable[Recording], cutoff_hz: float, torque: TorqueLog = "instantaneous"
) -> Iterator[FilteredPositions]:
    """Positions through a zero-phase low-pass; the torque at the same instants.

    A logged `torque` that is held until the next sample, or is the mean until then, belongs to the middle of that step: the torque at a
    sample is the mean of its own and the one before. Half a sample of delay between torque and twist would count as K T/2 of damping.

    `recordings` follow each other without a seam, as blocks of one log; so do the parts, and they do not depend on where the blocks
    are cut. Samples nearer to an end than one period of the cut-off are removed. Raises `FlexcalError` as `LowPass` does, and where all
    the samples are too few for it.
    """
    first, recordings = _peeked(recordings)
    step, n = first.time_step, first.q.shape[1]
    low_pass = LowPass(step, cutoff_hz)
    border = int(np.ceil(_BORDER_PERIODS / (cutoff_hz * step)))
    positions = n if first.arm is None else 2 * n
    samples, number = 0, 2
    held = np.zeros((0, positions + n))
    for values, own in _extended(recordings, low_pass):
        samples += own
        held = np.concatenate([held, values])
        q = low_pass.apply(held[:, :positions])
        if len(q) < 5:
            continue
        at, count = low_pass.support + 2, len(q) - 4
        acted = held[at : at + count, positions:]
        if torque != "instantaneous":
            acted = 0.5 * (acted + held[at - 1 : at - 1 + count, positions:])
        found = FilteredPositions(first.start + step * number, step, q, acted)
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
    """Positions (motor side, then arm side where measured) and torques side by side, and how many samples are measured ones.

    The others are what the filter needs before and after them.
    """
    begun = False
    end = np.zeros((0, 0))
    for recording in recordings:
        sides = [recording.q] if recording.arm is None else [recording.q, recording.arm]
        values = np.hstack([*sides, recording.torque])
        end = np.concatenate([end, values]) if end.size else values
        if begun:
            yield values, len(values)
        elif len(end) > low_pass.support:
            begun = True
            yield np.concatenate([low_pass.before(end), end]), len(end)
        if begun:
            end = end[-low_pass.support - 1 :]
    yield low_pass.before(end[::-1])[::-1], 0
