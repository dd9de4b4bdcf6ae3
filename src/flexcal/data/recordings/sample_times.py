"""Sample times of a log from its time stamps: order, repeated rows, clock."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from flexcal.errors import FlexcalError

GAP = 2.5
"""Ratio of a step to the time step above which it is a gap, unless it is short enough to be filled in."""
JITTER = 0.02
"""Time stamps within this part of a time step of the uniform base are taken as uniform."""
LATE = 0.05
"""Time, s, by which rows may be out of order; they are sorted."""
MOST_EQUAL = 5
"""Largest number of rows of one time stamp whose values are averaged."""
_COUNTED = 0.3
"""Deviation from the uniform base, in time steps, up to which every time stamp has a number of its own there."""
_MOST_LOST = 2.0
"""Largest number of lost samples per existing one; with more, samples came in bursts."""
_SMOOTHER = 0.5
"""Positions are sampled evenly where this share, or less, of their error of interpolation is left when time stamps are ignored."""
_DIFFER = 0.1
"""Difference of interpolation weights above which steps count as different."""
_GOES_ON = 0.5
"""Least speed relative to the previous one at which a robot has not stopped over repeated rows."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Rows `values` (N, m) at ascending times `t` (N,), s, with the number of rows `sorted`, `merged` (averaged with others of the same
    time stamp) and `repeated` (left out: all values as in the row before, although the robot moves).
    """

    t: np.ndarray
    values: np.ndarray
    sorted: int = 0
    merged: int = 0
    repeated: int = 0

    @property
    def repairs(self) -> np.ndarray:
        """Numbers of rows sorted, merged and repeated (3,)."""
        return np.array([self.sorted, self.merged, self.repeated])


@dataclass(frozen=True)
class Clock:
    """Sampling of time stamps: `time_step` (s), and the longest step that is no `gap`, s.

    `regular`: each stamp is next to a sample of a uniform base of its own, of which some may be missing. `even`: samples were taken at even
    times, about which only the stamps scatter, since positions are much smoother over their number than over the stamps.
    """

    time_step: float
    gap: float
    regular: bool = True
    even: bool = False


def in_order(t: np.ndarray, values: np.ndarray, positions: int) -> Samples:
    """Rows sorted by their stamps `t` (N,), without repeated ones; the first `positions` columns of the values (N, m) are positions."""
    samples = Samples(t, values)
    if (np.diff(t) < 0).any():
        order = np.argsort(t, kind="stable")
        late = int(np.sum(t < np.maximum.accumulate(t)))
        samples = Samples(t[order], values[order], sorted=late)
    return _without_repeated(samples, positions) if positions else samples


def clock_of(t: np.ndarray, positions: np.ndarray, fill: float) -> Clock:
    """Clock of ascending time stamps (N,) with positions (N, n); steps up to `fill` (s) are no gaps.

    The time step is that of the longest part without gaps. Raises `FlexcalError` where the stamps stand still. A
    rate within 1e-6, or five standard errors, of a whole number of Hz is taken as
    that one, so that logs of one controller have one time step.
    """
    gap = _longest_step(t, fill)
    edges = [0, *(np.flatnonzero(np.diff(t) > gap) + 1), t.size]
    first, end = max(pairwise(edges), key=lambda edge: edge[1] - edge[0])
    if end - first < 2:
        return Clock(float(np.median(np.diff(t))), gap)
    t, positions = t[first:end], positions[first:end]
    number = _numbers(t)
    regular = number is not None
    number = np.arange(t.size, dtype=float) if number is None else number
    step = line(t, number)[1]
    if step <= 0:
        raise FlexcalError(
            "E-LOG-024",
            f"the time stands still: samples have the same stamp, {t[0]:.9g} s; write the time with more digits, or repair the log.",
        )
    gap = max(GAP * step, fill)
    deviation = t - t[0] - step * number
    if np.ptp(deviation) <= 2 * JITTER * step and number[-1] == t.size - 1:
        return Clock(step, gap)
    if _evenly_sampled(t, positions):
        return Clock(line(t, np.arange(t.size))[1], gap, even=True)
    return Clock(step, gap, regular=regular)


def _numbers(t: np.ndarray) -> np.ndarray | None:
    """Numbers (N,) of the samples on a uniform base, with lost ones counted; None where stamps are not clearly next to one."""
    steps = np.diff(t)
    median = float(np.median(steps))
    if median <= 0:
        return None
    number = np.concatenate([[0.0], np.cumsum(np.maximum(1.0, np.rint(steps / median)))])
    start, step = line(t, number)
    near = np.abs(t - start - step * number).max() <= _COUNTED * step
    return number if near and number[-1] < _MOST_LOST * t.size else None


def line(t: np.ndarray, number: np.ndarray) -> tuple[float, float]:
    """Start and time step of the uniform base under stamps (N,) of these numbers, by least squares; whole rates as `clock_of` has them."""
    centred = number - number.mean()
    size = float(centred @ centred)
    step = float(centred @ (t - t[0])) / size
    residual = t - t[0] - step * number
    if step <= 0:
        return float(t[0]), 0.0
    error = float(residual.std()) / float(np.sqrt(size)) / step
    rate = 1.0 / step
    if round(rate) and abs(rate - round(rate)) < max(1e-6, min(5 * error, 1e-3)) * rate:
        step = 1.0 / round(rate)
    start = float(t[0] + np.mean((t - t[0]) - step * number))
    return (float(t[0]) if abs(start - t[0]) < 1e-6 * step else start), step


def _longest_step(t: np.ndarray, fill: float) -> float:
    steps = np.diff(t)
    usual = float(np.median(steps))
    inside = steps[steps <= max(GAP * usual, fill)]
    return max(GAP * usual, GAP * float(inside.mean()) if inside.size else 0.0, fill)


def _evenly_sampled(t: np.ndarray, positions: np.ndarray) -> bool:
    """Whether cubics through the two samples on either side miss those between much less when all steps count as equal.

    Samples count whose steps differ, of joints that move.
    """
    if t.size < 5:
        return False
    times = np.array([t[0:-4], t[1:-3], t[3:-1], t[4:]]) - t[2:-2]
    even = np.array([-1.0, 4.0, 4.0, -1.0])[:, None] / 6.0 * np.ones(t.size - 4)
    stamped = np.ones_like(times)
    with np.errstate(divide="ignore", invalid="ignore"):
        for j in range(4):
            for i in range(4):
                if i != j:
                    stamped[j] *= times[i] / (times[i] - times[j])
    differ = ~(np.abs(stamped - even).max(axis=0) <= _DIFFER)
    around = np.array([positions[0:-4], positions[1:-3], positions[3:-1], positions[4:]])
    moving = differ[:, None] & (np.abs(around[3] - around[0]) > 0)
    with np.errstate(invalid="ignore"):
        missed = [
            np.abs(np.einsum("kN,kNn->Nn", weights, around) - positions[2:-2]) for weights in (even, stamped)
        ]
    missed = [np.where(np.isfinite(values), values, np.inf) for values in missed]
    size = np.ptp(positions, axis=0)
    counts = moving.sum(axis=0)
    judges = np.flatnonzero(counts > 0.5 * counts.max(initial=0))
    judges = [int(k) for k in judges if size[k] > 0]
    if not judges:
        return False
    by_number, by_stamp = (
        float(np.median([np.median(m[moving[:, k], k]) / size[k] for k in judges])) for m in missed
    )
    return by_number < _SMOOTHER * by_stamp


def _without_repeated(samples: Samples, positions: int) -> Samples:
    """Without rows that repeat the one before while the robot goes on: the first of them is when they were sampled."""
    t, values = samples.t, samples.values
    same = values[1:, 0] == values[:-1, 0]
    if not same.any():
        return samples
    same = same & (values[1:] == values[:-1]).all(axis=1)
    starts = np.concatenate([[0], np.flatnonzero(~same) + 1])
    if not same.any() or starts.size < 3:
        return samples
    length = np.diff(np.append(starts, t.size))
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.diff(values[starts, :positions], axis=0) / np.diff(t[starts])[:, None]
        onward = np.sum(speed[1:] * speed[:-1], axis=1)
    runs = length > 1
    stale = np.zeros(starts.size, dtype=bool)
    stale[1:-1] = runs[1:-1] & (onward > _GOES_ON * np.sum(speed[:-1] ** 2, axis=1)) & (onward > 0)
    if 2 * stale.sum() > runs.sum():
        stale = runs & (length <= length[stale].max())
    keep = ~np.repeat(stale, length)
    keep[starts] = True
    return replace(samples, t=t[keep], values=values[keep], repeated=int(np.sum(~keep)))


def merged(samples: Samples) -> Samples:
    """With the mean of all rows that have one time stamp."""
    steps = np.diff(samples.t)
    if not (steps == 0).any():
        return samples
    starts = np.concatenate([[0], np.flatnonzero(steps > 0) + 1])
    length = np.diff(np.append(starts, samples.t.size))
    means = np.add.reduceat(samples.values, starts, axis=0) / length[:, None]
    return replace(samples, t=samples.t[starts], values=means, merged=samples.t.size - starts.size)
