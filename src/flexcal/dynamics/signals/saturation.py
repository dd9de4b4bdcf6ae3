"""Detection of saturation: consecutive samples at the largest or smallest value of a signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_SAMPLES = 5
"""Number of successive equal values beyond chance."""
_FINEST = 0.02
"""Share of the steps between samples that may be finer than the resolution, for repaired time stamps."""
_USUAL = 5.0
"""Least ratio of such a run to the mean run of equal values: slow sensors repeat every value."""
_APPROACH = 5e-3
"""Time, s, over which the speed before the extreme is evaluated."""
_FAST = 0.05
"""Share of the top speed at which no robot reaches a stop, unless it is its encoder's."""
_HARD = 2.0
"""Least ratio of such a stop to the usual changes of speed within `_APPROACH`; real robots reach a third of that."""
_USUALLY = 0.99
"""Share of the samples of a block that count as usual."""
_EVERY = 4
"""Stride of the samples of a block used to determine the usual ones."""
_STEPS = 8.0
"""Steps of its resolution by which the signal leaves its extreme within half the stay; a quantised peak leaves it by four."""
_OVERSHOOT = 0.1
"""Distance of a stay from the extreme of the signal, relative to the large steps between samples."""
_RIPPLE = 3
"""Samples on either side of a stay in which interpolation onto a uniform grid oscillates."""
_ROUNDING = 1e-12
"""Relative difference of values that count as equal."""
_LARGE = 0.5
"""Least size of an extreme relative to the largest: torque zero is a brake."""


@dataclass(frozen=True)
class SaturatedRun:
    """Run of up to `samples` equal values at `value`, entered or left at up to `speed` (1/s); half of them further out it is `drop`
    away.
    """

    value: float
    samples: int
    speed: float
    drop: float

    def merged(self, other: SaturatedRun) -> SaturatedRun:
        """Run combined with one at the same value in another part of the signal."""
        return SaturatedRun(
            self.value,
            max(self.samples, other.samples),
            max(self.speed, other.speed),
            max(self.drop, other.drop),
        )


class SaturationDetector:
    """Detector of saturation in one signal, block by block; runs across the border of two blocks count as two."""

    def __init__(self) -> None:
        self._ends: dict[int, SaturatedRun] = {}
        self._top_speed, self._usual_change = 0.0, 0.0
        self._samples, self._changes = 0, 1
        self._resolution = np.inf

    def add(self, values: np.ndarray, time_step: float) -> None:
        """Add the next block (N,), with samples every `time_step`, s."""
        reach = max(1, round(_APPROACH / time_step))
        speed = (values[reach:] - values[:-reach]) / (reach * time_step)
        change = np.abs(speed[reach:] - speed[:-reach])
        self._top_speed = max(self._top_speed, float(np.abs(speed).max(initial=0.0)))
        if len(change):
            self._usual_change = max(self._usual_change, float(np.quantile(change[::_EVERY], _USUALLY)))
        self._samples += len(values)
        steps = np.abs(np.diff(values))
        moving = steps[steps > 0]
        self._changes += len(moving)
        if len(moving):
            self._resolution = min(self._resolution, float(np.quantile(moving, _FINEST)))
        large = float(np.quantile(steps[::_EVERY], _USUALLY)) if len(steps) else 0.0
        same = steps <= _ROUNDING * np.abs(values).max()
        for sign in (-1, 1):
            run = _plateau(values, sign, same, _OVERSHOOT * large, np.abs(speed), reach)
            known = self._ends.get(sign, run)
            if np.isclose(run.value, known.value, rtol=_ROUNDING, atol=0.0):
                self._ends[sign] = run.merged(known)
            elif sign * run.value > sign * known.value:
                self._ends[sign] = run

    @property
    def span(self) -> float:
        """Range from the smallest to the largest value."""
        return self._ends[1].value - self._ends[-1].value

    @property
    def stay(self) -> SaturatedRun | None:
        """Longest significant run at an extreme not near zero."""
        size = max(abs(end.value) for end in self._ends.values())
        return next((end for end in self._long() if abs(end.value) >= _LARGE * size), None)

    @property
    def cut(self) -> SaturatedRun | None:
        """Longest run at an extreme that the signal enters or leaves too fast to have stopped by itself."""
        fast = max(_FAST * self._top_speed, _HARD * self._usual_change)
        return next((end for end in self._long() if end.speed > fast), None)

    def _long(self) -> list[SaturatedRun]:
        least = max(_SAMPLES, _USUAL * self._samples / self._changes)
        far = _STEPS * self._resolution
        return [end for end in self._ends.values() if end.samples >= least and end.drop > far]


def _plateau(
    values: np.ndarray, sign: int, same: np.ndarray, overshoot: float, speed: np.ndarray, reach: int
) -> SaturatedRun:
    """Longest run at the largest (`sign` 1) or smallest value, with the highest speed at any.

    `same` (N - 1,) are the samples followed by their like, `speed` is that over `reach` samples from each on. Where time stamps were
    repaired, the interpolation overshoots the ends of a stay by up to `overshoot`.
    """
    extreme = float(sign * np.max(sign * values))
    near = np.abs(values - extreme) <= overshoot
    same = same & near[1:] & near[:-1]
    borders = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]])))
    starts, ends = borders[::2], borders[1::2] + 1
    if not len(starts):
        return SaturatedRun(extreme, 1, 0.0, 0.0)
    k = int(np.argmax(ends - starts))
    count = int(ends[k] - starts[k])
    around = values[max(0, starts[k] - count // 2) : ends[k] + count // 2]
    stays = ends - starts >= _SAMPLES
    first, last = starts[stays], ends[stays]
    for _ in range(_RIPPLE):
        first = np.where((first > 0) & near[first - 1], first - 1, first)
        last = np.where((last < len(near)) & near[np.minimum(last, len(near) - 1)], last + 1, last)
    beside = np.concatenate([first - reach - 1, first - reach, last - 1, last])
    fastest = float(speed[beside[(beside >= 0) & (beside < len(speed))]].max(initial=0.0))
    value = float(values[starts[k]])
    return SaturatedRun(value, count, fastest, float(np.abs(around - value).max()))
