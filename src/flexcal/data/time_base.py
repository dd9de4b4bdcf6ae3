"""Uniform time base fitted to measured time stamps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from flexcal.errors import FlexcalError

GAP = 2.5
"""A step longer than this many time steps is a gap; a single lost sample is filled in."""
ENOUGH = 200
"""Samples that the time step of blocks is taken from, at least, where there are as many."""
JITTER = 0.02
"""Time stamps within this part of a time step of the uniform base are taken as uniform."""


@dataclass(frozen=True)
class TimeBase:
    """The uniform base t = start + k · time_step (s, k < samples) fitted to N time stamps, and how they lie about it.

    jitter: standard deviation of the time stamps about the base, s; jitter_max: the largest deviation.
    lost: single samples that are missing and filled in by interpolation.
    resampled: whether values are interpolated onto the base, or taken as they are since the stamps fit within 2 %.
    gap: seconds without samples before the start, where the log has a gap there.
    """

    start: float
    time_step: float
    samples: int
    jitter: float
    jitter_max: float
    lost: int
    resampled: bool
    gap: float = 0.0


def gaps(t: np.ndarray, time_step: float | None = None) -> np.ndarray:
    """Indices i where a gap lies between t[i] and t[i + 1]: a step of more than 2.5 (median) time steps."""
    steps = np.diff(t)
    if not steps.size:
        return np.zeros(0, dtype=int)
    return np.flatnonzero(steps > GAP * (np.median(steps) if time_step is None else time_step))


def fit_time_base(t: np.ndarray, time_step: float | None = None) -> TimeBase:
    """The base under ascending time stamps (N,) without gaps, by least squares.

    A rate within 1e-6, or five standard errors, of a whole number of Hz is taken as that one, so that logs of one
    controller have one time step. With `time_step` given only the start is fitted. Raises `FlexcalError` for fewer than
    two time stamps.
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
        residual = t - t[0] - time_step * number
        error = float(residual.std()) / float(np.sqrt(centred @ centred)) / time_step
        if round(rate) and abs(rate - round(rate)) < max(1e-6, min(5 * error, 1e-3)) * rate:
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


def uniform_blocks(blocks: Iterable[tuple[np.ndarray, np.ndarray]]) -> Iterator[tuple[TimeBase, np.ndarray]]:
    """Blocks of ascending time stamps (N,) with values (N, m), put on one uniform base as they come.

    The time step is that of the longest stretch of the first block (of at least 200 samples). What follows without a
    gap continues the base of the block before; after a gap the base starts anew, and `gap` says how long it was. A
    block may hold back its last samples for the next. Raises `FlexcalError` for fewer than two samples in all.
    """
    step, gap, origin, done = 0.0, 0.0, None, 0
    t, values = np.zeros(0), np.zeros(0)
    for block_t, block_values, last in _with_last(blocks):
        t = np.concatenate([t, block_t])
        values = np.concatenate([values, block_values]) if values.size else block_values
        if not step and t.size < ENOUGH and not last:
            continue
        if not step and t.size < 2:
            raise FlexcalError("a recording needs at least two samples.")
        edges = [0, *(gaps(t, step or None) + 1), t.size]
        if not step:
            first, end = max(pairwise(edges), key=lambda edge: edge[1] - edge[0])
            step = fit_time_base(t[first:end]).time_step if end - first > 1 else float(np.median(np.diff(t)))
        for first, end in pairwise(edges):
            piece, whole = t[first:end], last or end < t.size
            start = _start(piece, step) if origin is None else origin + done * step
            steps = (piece[-1] - start) / step
            count = round(steps) + 1 if whole else int(steps) - 2
            if count > 0:
                base, part = _placed(piece, values[first:end], start, step, count)
                yield replace(base, gap=gap), part
                gap = 0.0
                origin, done = (start, count) if origin is None else (origin, done + count)
            if whole:
                origin, done = None, 0
                gap = float(t[end] - t[end - 1]) if end < t.size else 0.0
        kept = edges[-2]
        if origin is not None:
            kept += int(np.searchsorted(t[kept:], origin + (done - 3) * step))
        t, values = t[kept:], values[kept:]


def _with_last(
    blocks: Iterable[tuple[np.ndarray, np.ndarray]],
) -> Iterator[tuple[np.ndarray, np.ndarray, bool]]:
    iterator = iter(blocks)
    held = next(iterator, None)
    while held is not None:
        following = next(iterator, None)
        yield (*held, following is None)
        held = following


def _start(t: np.ndarray, step: float) -> float:
    return fit_time_base(t, step).start if t.size > 1 else float(t[0])


def _placed(
    t: np.ndarray, values: np.ndarray, start: float, step: float, count: int
) -> tuple[TimeBase, np.ndarray]:
    """The values at start + k · step, k < count, with how the time stamps lie about that base."""
    number = np.rint((t - start) / step)
    deviation = t - (start + step * number)
    rows = (number >= 0) & (number < count)
    jitter = deviation[rows] if rows.any() else np.zeros(1)
    largest = float(np.abs(jitter).max())
    lost = count - np.unique(number[rows]).size
    base = TimeBase(
        start, step, count, float(jitter.std()), largest, lost, bool(lost) or largest > JITTER * step
    )
    if base.resampled and t.size > 1:
        return base, resample(t, values, base)
    return base, values[rows]
