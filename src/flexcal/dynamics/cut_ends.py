"""A signal that stays at its largest or smallest value, sample after sample: a limit of the sensor, not of the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_SAMPLES = 5
"""Equal values in a row that are no chance."""
_FINEST = 0.02
"""Share of the steps between samples that may be finer than the resolution, where time stamps were repaired."""
_USUAL = 5.0
"""How many times longer than the mean run of equal values they must be: slow sensors repeat every value."""
_APPROACH = 5e-3
"""s over which the speed before the extreme is looked at."""
_FAST = 0.25
"""Share of the top speed at which no robot runs into a stop unless it is its encoder's."""
_STEPS = 8.0
"""Steps of its resolution by which the signal leaves its extreme within half the stay; a peak that is quantised leaves it by four."""
_LARGE = 0.5
"""Share of the largest size that an extreme must have: torque zero is a brake."""


@dataclass(frozen=True)
class Plateau:
    """So many `samples` in a row at `value`, entered or left at `speed` (1/s); half of them further out it is `drop` away."""

    value: float
    samples: int
    speed: float
    drop: float


class CutEnds:
    """Takes one signal block by block; runs across the border of two blocks count as two."""

    def __init__(self) -> None:
        self._ends: dict[int, Plateau] = {}
        self._top_speed = 0.0
        self._size = 0.0
        self._samples, self._changes = 0, 1
        self._resolution = np.inf

    def add(self, values: np.ndarray, time_step: float) -> None:
        """The block (N,) that follows, with samples every `time_step`, s."""
        reach = max(1, round(_APPROACH / time_step))
        moved = np.abs(values[reach:] - values[:-reach]) / (reach * time_step)
        self._top_speed = max(self._top_speed, float(moved.max(initial=0.0)))
        self._size = max(self._size, float(np.abs(values).max()))
        self._samples += len(values)
        steps = np.abs(np.diff(values))
        steps = steps[steps > 0]
        self._changes += len(steps)
        if len(steps):
            self._resolution = min(self._resolution, float(np.quantile(steps, _FINEST)))
        for sign in (-1, 1):
            found = _longest(values, float(sign * np.max(sign * values)), moved, reach)
            known = self._ends.get(sign)
            if (
                known is None
                or sign * found.value > sign * known.value
                or (found.value == known.value and found.samples > known.samples)
            ):
                self._ends[sign] = found

    @property
    def held(self) -> Plateau | None:
        """The longest stay at an extreme that is no chance, and not near zero."""
        return next((end for end in self._long() if abs(end.value) >= _LARGE * self._size > 0), None)

    @property
    def cut(self) -> Plateau | None:
        """The longest stay at an extreme into or out of which the signal runs too fast to have stopped by itself."""
        return next((end for end in self._long() if end.speed > _FAST * self._top_speed), None)

    def _long(self) -> list[Plateau]:
        least = max(_SAMPLES, _USUAL * self._samples / self._changes)
        far = _STEPS * self._resolution
        return [end for end in self._ends.values() if end.samples >= least and end.drop > far]


def _longest(values: np.ndarray, extreme: float, moved: np.ndarray, reach: int) -> Plateau:
    """The longest run of `extreme`; `moved` is the speed over `reach` samples from each on."""
    at = np.concatenate([[False], values == extreme, [False]])
    borders = np.flatnonzero(at[1:] != at[:-1])
    starts, ends = borders[::2], borders[1::2]
    k = int(np.argmax(ends - starts))
    before = moved[starts[k] - reach] if starts[k] >= reach else 0.0
    after = moved[ends[k] - 1] if ends[k] - 1 < len(moved) else 0.0
    count = int(ends[k] - starts[k])
    around = values[[max(0, starts[k] - count // 2), min(len(values), ends[k] + count // 2) - 1]]
    return Plateau(extreme, count, float(max(before, after)), float(np.abs(around - extreme).max()))
