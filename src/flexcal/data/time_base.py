"""The uniform time base under measured time stamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError

GAP = 2.5
"""A step longer than this many time steps is a gap; a single lost sample is filled in."""
JITTER = 0.02
"""Time stamps within this part of a time step of the uniform base are taken as uniform."""


@dataclass(frozen=True)
class TimeBase:
    """The uniform base t = start + k · time_step (s, k < samples) fitted to N time stamps, and how they lie about it.

    jitter: standard deviation of the time stamps about the base, s; jitter_max: the largest deviation.
    lost: single samples that are missing and filled in by interpolation.
    resampled: whether values are interpolated onto the base, or taken as they are since the stamps fit within 2 %.
    """

    start: float
    time_step: float
    samples: int
    jitter: float
    jitter_max: float
    lost: int
    resampled: bool


def gaps(t: np.ndarray, time_step: float | None = None) -> np.ndarray:
    """Indices i where a gap lies between t[i] and t[i + 1]: a step of more than 2.5 (median) time steps."""
    steps = np.diff(t)
    if not steps.size:
        return np.zeros(0, dtype=int)
    return np.flatnonzero(steps > GAP * (np.median(steps) if time_step is None else time_step))


def fit_time_base(t: np.ndarray, time_step: float | None = None) -> TimeBase:
    """The base under ascending time stamps (N,) without gaps, by least squares; a rate within 1e-6 of a whole number of Hz is that one.

    With `time_step` given only the start is fitted. Raises `FlexcalError` for fewer than two time stamps.
    """
    if t.size < 2:
        raise FlexcalError("a recording needs at least two samples.")
    steps = np.diff(t)
    median = float(np.median(steps)) if time_step is None else time_step
    counts = np.where(steps > 1.5 * median, 2, 1)
    number = np.concatenate([[0], np.cumsum(counts)])
    if time_step is None:
        centred = number - number.mean()
        time_step = float(centred @ (t - t[0])) / float(centred @ centred)
        rate = 1.0 / time_step
        if round(rate) and abs(rate - round(rate)) < 1e-6 * rate:
            time_step = 1.0 / round(rate)
    start = float(t[0] + np.mean((t - t[0]) - time_step * number))
    if abs(start - t[0]) < 1e-6 * time_step:
        start = float(t[0])
    deviation = t - (start + time_step * number)
    largest = float(np.abs(deviation).max())
    lost = int(np.sum(counts == 2))
    return TimeBase(
        start=start,
        time_step=time_step,
        samples=int(number[-1]) + 1,
        jitter=float(deviation.std()),
        jitter_max=largest,
        lost=lost,
        resampled=lost > 0 or largest > JITTER * time_step,
    )


def resample(t: np.ndarray, values: np.ndarray, base: TimeBase) -> np.ndarray:
    """Values (N, …) at times t (N,) on the base, (samples, …): the cubic through the four nearest samples.

    Next to the ends the cubic is that of the last four samples; with fewer than four, straight lines.
    """
    if not base.resampled:
        return values
    at = base.start + base.time_step * np.arange(base.samples)
    points = min(4, t.size) if t.size >= 4 else 2
    first = np.clip(np.searchsorted(t, at, side="right") - points // 2, 0, t.size - points)
    nodes = t[first[:, None] + np.arange(points)]
    result = np.zeros((base.samples, *values.shape[1:]))
    for j in range(points):
        weight = np.ones(base.samples)
        for k in range(points):
            if k != j:
                weight *= (at - nodes[:, k]) / (nodes[:, j] - nodes[:, k])
        result += weight.reshape(-1, *([1] * (values.ndim - 1))) * values[first + j]
    return result
