"""Filtered positions, velocities, accelerations and torques of a recording."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain, groupby
from typing import Literal

import numpy as np

from flexcal.data.recordings import LowPass, Recording, TooFewSamples
from flexcal.dynamics.signals.arm_side import ArmSide
from flexcal.errors import FlexcalError

TorqueLog = Literal["held", "instantaneous", "mean"]
"""Meaning of a logged torque over its sample."""

AT_REST = 1e-3
"""Speed, rad/s or m/s, below which a joint is at rest and its motion noise."""
_REVERSES = 0.1
"""Acceleration, rad/s² or m/s², from which a slow joint reverses rather than rests: it is that slow for less than 20 ms, and friction
changes sign.
"""
_BORDER_PERIODS = 3.0
"""Length cut from either end, in periods of the cut-off: the filter's transient falls to a tenth in each."""
_APART = 1.5
"""Steps between samples above which there is a gap."""
BESIDE = 2
"""Number of samples on either side used by differences of fourth order."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion `q`, `dq`, `ddq` (N, n) in rad, m and s, and the motor `torque` (N, n) referred to the joint, at `time` (N,), s.

    Positions are the motors', referred to the joint; `arm` has those behind elastic drives, where they were measured. `external` (N, n)
    is the torque that acts on the joints from outside, τ_ext of Eq. 2.20; None for none.
    """

    time: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    torque: np.ndarray
    arm: ArmSide | None = None
    external: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.time)

    @property
    def name(self) -> str:
        """Name in messages."""
        return "the motion"

    @property
    def samples(self) -> int:
        """Number of samples of the whole experiment, which is this motion."""
        return len(self)

    @property
    def top_speed(self) -> np.ndarray:
        """Largest |q̇| of every joint (n,)."""
        return np.abs(self.dq).max(axis=0)

    @property
    def cutoff_hz(self) -> float:
        """Infinite: a motion is used unfiltered."""
        return np.inf

    @property
    def net(self) -> np.ndarray:
        """Net torque τ + τ_ext (N, n), the right-hand side of Eq. 2.20."""
        return self.torque if self.external is None else self.torque + self.external

    def tilt(self, component: int, order: int) -> np.ndarray:
        """Tilts (N, n) of the bearings about x (`component` 0) or y (1), rad, or their time derivative of that order.

        Raises `FlexcalError` where they were not measured.
        """
        if self.arm is None or self.arm.tilts is None:
            raise FlexcalError("E-DYN-038", f"{self.name} has no tilts of the bearings.")
        side = self.arm.tilts[component]
        return (side.q, side.dq, side.ddq)[order]

    def blocks(self) -> Iterator[Motion]:
        """Experiment as a single part."""
        yield self

    def part(self, start: int, stop: int) -> Motion:
        """Samples from `start` to before `stop`."""
        at = slice(start, stop)
        arm = None if self.arm is None else self.arm.part(start, stop)
        external = None if self.external is None else self.external[at]
        return Motion(self.time[at], self.q[at], self.dq[at], self.ddq[at], self.torque[at], arm, external)

    @classmethod
    def joined(cls, parts: Iterable[Motion]) -> Motion:
        """Concatenation of consecutive motions."""
        motions = list(parts)
        columns = zip(*((m.time, m.q, m.dq, m.ddq, m.torque) for m in motions), strict=True)
        outside = [m.external for m in motions if m.external is not None]
        return cls(
            *(np.concatenate(column) for column in columns),
            arm=ArmSide.joined([m.arm for m in motions]),
            external=np.concatenate(outside) if outside else None,
        )

    @classmethod
    def of(cls, recording: Recording, cutoff_hz: float, torque: TorqueLog = "instantaneous") -> Motion:
        """Whole motion of a recording by `filtered_motion`; raises `FlexcalError` as that does."""
        return cls.joined(filtered_motion([recording], cutoff_hz, torque))


@dataclass(frozen=True, eq=False)
class FilteredPositions:
    """Filtered positions: N samples from `start` (s) on, `time_step` (s) apart: `torque` (N, n), and `q` (N + 4, n), which begins two
    samples before.

    Where the arm side was measured too, its positions follow those of the motors, and the tilts about x and y
    these: `q` (N + 4, 2 n or 4 n). `external` is (N, n), or (N, 0).
    """

    start: float
    time_step: float
    q: np.ndarray
    torque: np.ndarray
    external: np.ndarray

    def __len__(self) -> int:
        return len(self.torque)

    def part(self, start: int, stop: int) -> FilteredPositions:
        """Samples from `start` to before `stop`."""
        time = self.start + start * self.time_step
        at = slice(start, stop)
        return FilteredPositions(
            time, self.time_step, self.q[start : stop + 4], self.torque[at], self.external[at]
        )

    def motion(self) -> Motion:
        """Motion with velocities and accelerations by central differences; zero for a joint at rest, whose sign friction would take."""
        time = self.start + self.time_step * np.arange(len(self))
        n = self.torque.shape[1]
        q, dq, ddq = differences(self.q, self.time_step)
        turning, reversing = (
            dq[:, : 2 * n],
            np.abs(ddq[:, : 2 * n]) > _REVERSES,
        )  # tilts are slow, and have no friction
        turning[(np.abs(turning) < AT_REST) & ~reversing] = 0.0
        at = [slice(first, first + n) for first in range(n, q.shape[1], n)]
        sides = [ArmSide(q[:, own], dq[:, own], ddq[:, own]) for own in at]
        arm = None if not sides else sides[0]
        if len(sides) == 3:
            arm = replace(sides[0], tilts=(sides[1], sides[2]))
        external = self.external if self.external.size else None
        return Motion(time, q[:, :n], dq[:, :n], ddq[:, :n], self.torque, arm, external)


def filtered_motion(
    recordings: Iterable[Recording], cutoff_hz: float, torque: TorqueLog = "instantaneous"
) -> Iterator[Motion]:
    """Motions of `filtered_positions`; raises `FlexcalError` as that does."""
    return (part.motion() for part in filtered_positions(recordings, cutoff_hz, torque))


def filtered_positions(
    recordings: Iterable[Recording], cutoff_hz: float, torque: TorqueLog = "instantaneous"
) -> Iterator[FilteredPositions]:
    """Positions through a zero-phase low-pass, and the torque at the same instants.

    A logged `torque` that is held until the next sample, or is the mean until then, belongs to the middle of that step: the torque at a
    sample is the mean of its own and the one before. Half a sample of delay between torque and twist would count as K T/2 of damping.

    `recordings` follow each other as blocks of one log; so do the parts, and they do not depend on where the blocks are cut. What lies
    between two gaps of the log is filtered by itself, and left out where it is too short for that. Samples nearer to an end than three
    periods of the cut-off are removed. Raises `FlexcalError` as `LowPass` does, and where all the samples are too few for it.
    """
    short: TooFewSamples | None = None
    long = False
    for stretch in between_gaps(recordings):
        try:
            for part in _filtered(stretch, cutoff_hz, torque):
                long = True
                yield part
        except TooFewSamples as problem:
            short = short or problem
    if short is not None and not long:
        raise short


def stretches(motions: Iterable[Motion]) -> Iterator[Iterator[Motion]]:
    """Parts of a motion grouped into stretches without gap."""
    last, step, number = -np.inf, np.inf, 0

    def stretch(motion: Motion) -> int:
        nonlocal last, step, number
        step = float(motion.time[1] - motion.time[0]) if len(motion) > 1 else step
        number += bool(motion.time[0] - last > _APART * step)
        last = float(motion.time[-1])
        return number

    for _, group in groupby((motion for motion in motions if len(motion)), stretch):
        yield group


def between_gaps(recordings: Iterable[Recording]) -> Iterator[Iterator[Recording]]:
    """Recordings of a log in groups without gaps; each group is consumed before the next is requested."""
    number = 0

    def stretch(recording: Recording) -> int:
        nonlocal number
        base = recording.time_base
        number += base is not None and base.gap > 0
        return number

    for _, group in groupby(recordings, stretch):
        yield group


def _filtered(
    recordings: Iterable[Recording], cutoff_hz: float, torque: TorqueLog
) -> Iterator[FilteredPositions]:
    iterator = iter(recordings)
    first = next(iterator)
    step = first.time_step
    border = int(np.ceil(_BORDER_PERIODS / (cutoff_hz * step)))
    columns = _columns(chain([first], iterator), torque)
    number, pending = 0, None
    n = first.torque.shape[1]
    for q, acted in smoothed(columns, LowPass(step, cutoff_hz)):
        if pending is not None:
            yield pending
        filtered = FilteredPositions(first.start + step * number, step, q, acted[:, :n], acted[:, n:])
        pending = filtered.part(min(max(0, border - number), len(filtered)), len(filtered))
        number += len(filtered)
    if pending is not None:
        yield pending.part(0, len(pending) - border)


def _columns(recordings: Iterable[Recording], torque: TorqueLog) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Positions (motor side, then arm side if measured) and the torques at the same instants: motors, then external."""
    last = None
    for recording in recordings:
        sides = [recording.q, recording.arm, recording.tilt_x, recording.tilt_y]
        sides = [side for side in sides if side is not None]
        acted = recording.torque
        if torque != "instantaneous":
            before = np.concatenate([acted[:1] if last is None else last, acted[:-1]])
            last, acted = acted[-1:], 0.5 * (acted + before)
        if recording.external_torque is not None:
            acted = np.hstack([acted, recording.external_torque])
        yield np.hstack(sides), acted


def smoothed(
    blocks: Iterable[tuple[np.ndarray, np.ndarray]], low_pass: LowPass
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Filtered values (M + 4, k), from two samples before to two after, with unfiltered ones (M, m), for all samples.

    A block is values (N, k) and what goes with them (N, m). The last part is longer than the support of the filter. Raises
    `FlexcalError` as `LowPass.before` does.
    """
    waiting: list[np.ndarray] = []

    def watched() -> Iterator[np.ndarray]:
        for values, beside in blocks:
            waiting.append(beside)
            yield values

    pending = None
    for values in _extended(watched(), low_pass):
        pending = values if pending is None else np.concatenate([pending, values])
        x = low_pass.apply(pending)
        count = len(x) - 2 * BESIDE
        if count <= 0:
            continue
        beside = np.concatenate(waiting)
        waiting[:] = [beside[count:]]
        yield x, beside[:count]
        pending = pending[count:]


def differences(x: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inner values and their first and second central differences, (N, k) each, of values (N + 4, k) every `step` h (s).

    They are of fourth order: of a frequency ω they are too small by (ωh)⁴/30 and (ωh)⁴/90, where the difference of first differences lacks
    (ωh)²/3, which all stiffnesses would lack with the accelerations.
    """
    before2, before, at, after, after2 = (x[k : len(x) - 4 + k] for k in range(5))
    first = (8.0 * (after - before) - (after2 - before2)) / (12.0 * step)
    near, far = (after - at) - (at - before), (after2 - at) - (at - before2)
    second = (16.0 * near - far) / (12.0 * step**2)
    return at, first, second


def _extended(blocks: Iterable[np.ndarray], low_pass: LowPass) -> Iterator[np.ndarray]:
    """Blocks with the samples that filter and differences need before the first and after the last."""
    begun = False
    end = np.zeros((0, 0))
    for values in blocks:
        end = np.concatenate([end, values]) if end.size else values
        if begun:
            yield values
        elif len(end) > low_pass.support + BESIDE:
            begun = True
            yield np.concatenate([low_pass.before(end, BESIDE), end])
        if begun:
            end = end[-low_pass.support - BESIDE - 1 :]
    yield low_pass.before(end[::-1], BESIDE)[::-1]
