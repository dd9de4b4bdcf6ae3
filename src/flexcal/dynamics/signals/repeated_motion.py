"""Periodic motion, cut into its periods (Swevers 1997)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.data.recordings import LowPass
from flexcal.dynamics.signals.experiment import Experiment, Window, slowest_speeds
from flexcal.dynamics.signals.motion import Motion, stretches
from flexcal.errors import FlexcalError

FEWEST = 4
"""Periods whose scatter tells a noise level: three degrees of freedom at each line."""
_SAME = 1e-4
"""Mean squared difference of positions a period apart, over twice their variance: 1 % of the amplitude."""
_AWAY = 1e-2
"""What that must have reached before: a slow motion is like itself a sample later."""
_MOMENT = 0.05
"""s of rest that a period may begin or end with."""
_STANDS_OUT = 40.0
"""Power of a line over its variance; F(2, 6) exceeds it three times in ten thousand, F(2, 8) less often."""


@dataclass(frozen=True, eq=False)
class RepeatedMotion:
    """`periods` of as many samples that follow each other, their positions through a low-pass at `cutoff_hz` (infinite for none)."""

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
        """The periods, of their positions those lines that stand out of the scatter between them; the torques are as they are.

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
        """All whole periods of an experiment inside the window, from where the robot begins to move there.

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
    """What lies in a window, without the rest of the robot before and after its motion but for a moment."""
    start, end = np.searchsorted(whole.time, [window.start, window.end])
    moves = start + np.flatnonzero((np.abs(whole.dq[start:end]) > slowest).any(axis=1))
    if not len(moves):
        return whole.part(0, 0)
    beside = int(np.searchsorted(whole.time, whole.time[0] + _MOMENT))
    return whole.part(max(start, moves[0] - beside), min(end, moves[-1] + beside + 1))


def _standing_out(periods: np.ndarray) -> np.ndarray:
    """Which lines (N/2 + 1, n) of the average of (P, N, n) noise alone would not make as large."""
    lines = np.fft.rfft(periods, axis=1)
    mean, freedom = lines.mean(axis=0), len(lines) - 1
    variance = np.sum(np.abs(lines - mean) ** 2, axis=0) / (freedom * len(lines))
    seen = np.abs(mean) ** 2 > _STANDS_OUT * variance
    seen[0] = True
    return seen


def _period(q: np.ndarray) -> int:
    """Samples, 0 where `q` (N, n) does not repeat."""
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
