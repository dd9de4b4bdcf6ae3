"""Periodic motion cut into its periods (Swevers 1997)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.data.recordings import LowPass
from flexcal.dynamics.signals.experiment import Experiment, Window, slowest_speeds
from flexcal.dynamics.signals.motion import Motion, stretches
from flexcal.errors import FlexcalError

FEWEST = 4
"""Least number of periods for a noise level from their scatter: three degrees of freedom at each line."""
_SAME = 1e-4
"""Mean squared difference of positions a period apart, relative to twice their variance: 1 % of the amplitude."""
_AWAY = 1e-2
"""Level that this must reach before: a slow motion resembles itself a sample later."""
_MOMENT = 0.05
"""Rest, s, that a period may begin or end with."""
_STANDS_OUT = 40.0
"""Ratio of a line's power to its variance from which it is significant; F(2, 6) exceeds it three times in ten thousand, F(2, 8) less
often.
"""


@dataclass(frozen=True, eq=False)
class RepeatedMotion:
    """Consecutive `periods` of equal length, their positions through a low-pass at `cutoff_hz` (infinite for none)."""

    periods: tuple[Motion, ...]
    cutoff_hz: float

    @property
    def mean(self) -> Motion:
        """Average of all `smooth` periods, time included."""
        time, q, dq, ddq, torque = (
            np.array([getattr(p, name) for p in self.smooth]).mean(axis=0)
            for name in ("time", "q", "dq", "ddq", "torque")
        )
        return Motion(time, q, dq, ddq, torque)

    @cached_property
    def smooth(self) -> tuple[Motion, ...]:
        """Periods whose positions have only the significant lines; the torques are unchanged.

        What the other lines hold is noise, of which high derivatives have much, and it would bend the parameters. What the low-pass took
        from those that stand out is given back; above its cut-off there is nothing to give back. Derivatives are those of the lines.
        """
        q = np.array([period.q for period in self.periods])
        size, time = q.shape[1], self.periods[0].time
        step = float(time[-1] - time[0]) / (size - 1)
        frequency = np.fft.rfftfreq(size, step)
        share = np.ones_like(frequency)
        if np.isfinite(self.cutoff_hz):
            gain = LowPass(step, self.cutoff_hz).gain(frequency)
            share = np.where(frequency <= self.cutoff_hz, gain, np.inf)
        lines = np.fft.rfft(q, axis=1) * _standing_out(q) / share[:, None]
        omega = 2j * np.pi * frequency[:, None]
        moved = zip(*(np.fft.irfft(lines * omega**order, n=size, axis=1) for order in range(3)), strict=True)
        return tuple(
            Motion(p.time, *states, torque=p.net) for p, states in zip(self.periods, moved, strict=True)
        )

    @classmethod
    def of(cls, experiment: Experiment, window: Window) -> RepeatedMotion:
        """All whole periods of an experiment inside the window, from the start of motion there.

        Of a recording with gaps, those of the longest stretch. The period is the shortest lag after which positions are the same to 1 %
        of their amplitude. Raises `FlexcalError` for a motion that does not repeat, or does so less than four times.
        """
        slowest = slowest_speeds(experiment)
        each = (
            _moving(Motion.joined(stretch), window, slowest) for stretch in stretches(experiment.blocks())
        )
        motion = max(each, key=len)
        size = _period(motion.q)
        count = len(motion) // size if size else 0
        if count < FEWEST:
            what = f"shows {count} whole periods" if size else "contains no periodic motion"
            raise FlexcalError(
                "E-DYN-041",
                f"{experiment.name} {what}; maximum likelihood estimates the noise from the scatter between periods, of which "
                f"it needs at least {FEWEST}: record more periods, and "
                "some time for the filters, or take --estimator wls.",
            )
        return cls(tuple(motion.part(size * k, size * (k + 1)) for k in range(count)), experiment.cutoff_hz)


def _moving(whole: Motion, window: Window, slowest: np.ndarray) -> Motion:
    """Part of a window without the rest before and after the motion, but for a moment."""
    start, end = np.searchsorted(whole.time, [window.start, window.end])
    moves = start + np.flatnonzero((np.abs(whole.dq[start:end]) > slowest).any(axis=1))
    if not len(moves):
        return whole.part(0, 0)
    beside = int(np.searchsorted(whole.time, whole.time[0] + _MOMENT))
    return whole.part(max(start, moves[0] - beside), min(end, moves[-1] + beside + 1))


def _standing_out(periods: np.ndarray) -> np.ndarray:
    """Mask (N/2 + 1, n) of significant lines of the average of (P, N, n)."""
    lines = np.fft.rfft(periods, axis=1)
    mean, freedom = lines.mean(axis=0), len(lines) - 1
    variance = np.sum(np.abs(lines - mean) ** 2, axis=0) / (freedom * len(lines))
    seen = np.abs(mean) ** 2 > _STANDS_OUT * variance
    seen[0] = True
    return seen


def _period(q: np.ndarray) -> int:
    """Period in samples, 0 if `q` (N, n) does not repeat."""
    moved = q - q.mean(axis=0) if len(q) else q
    power = float(np.sum(moved**2))
    if power == 0:
        return 0
    length = 1 << (2 * len(q) - 1).bit_length()
    lines = np.fft.rfft(moved, length, axis=0)
    products = np.fft.irfft(np.sum(np.abs(lines) ** 2, axis=1), length)[: len(q)]
    squares = np.concatenate([[0.0], np.cumsum(np.sum(moved**2, axis=1))])
    lags = np.arange(len(q) // 2 + 1)
    apart = squares[len(q) - lags] + power - squares[lags] - 2 * products[lags]
    apart *= len(q) / (2 * power * (len(q) - lags))
    left = np.flatnonzero(apart > _AWAY)
    back = np.flatnonzero((apart < _SAME) & (lags > (left[0] if len(left) else len(q))))
    if not len(back):
        return 0
    run = back[: np.flatnonzero(np.diff(back, append=np.inf) > 1)[0] + 1]
    return int(run[np.argmin(apart[run])])
