"""Detection of the period of a repeated excitation."""

from __future__ import annotations

import numpy as np
from scipy.signal import fftconvolve

_SAME = 0.1
"""Variance of the difference of two periods, relative to twice the signal's, below which they count as equal."""
_DIFFERENT = 0.5
"""Level that this variance must exceed at a shorter lag, since any signal resembles itself after a short time."""
_MULTIPLE = 2.0
_FRACTION = 0.02
"""Largest deviation of a period from a whole number of samples, over the record, times the number of periods."""


def find_period(signal: np.ndarray) -> int | None:
    """Period of a signal (N, c) in samples, at most N/2; None without a period of a whole number of samples.

    The lag P with the least mean square of x(t + P) - x(t), where that is small; of multiples the shortest.
    """
    centred = signal - signal.mean(0)
    scale = centred.std(0)
    centred = centred[:, scale > 0] / scale[scale > 0]
    count = len(centred)
    if not centred.size or count < 8:
        return None
    correlation = np.sum([fftconvolve(x, x[::-1])[count - 1 :] for x in centred.T], axis=0)
    squares = np.concatenate([[0.0], np.cumsum((centred**2).sum(1))])
    lags = np.arange(1, count // 2 + 1)
    energy = squares[count - lags] + squares[count] - squares[lags]
    difference = 1.0 - 2.0 * correlation[lags] / np.maximum(energy, 1e-12 * squares[-1])
    risen = np.flatnonzero(difference > _DIFFERENT)
    if not risen.size:
        return None
    first = int(risen[0])
    least = difference[first:].min()
    if least > _SAME:
        return None
    near = np.flatnonzero(difference[first:] <= max(_MULTIPLE * least, 1e-6)) + first
    end = near[np.searchsorted(np.diff(near) > 1, True)] if (np.diff(near) > 1).any() else near[-1]
    stretch = near[near <= end]
    at = int(stretch[np.argmin(difference[stretch])])
    if not _is_whole(difference, at, count // int(lags[at])):
        return None
    return int(lags[at])


def _is_whole(difference: np.ndarray, at: int, periods: int) -> bool:
    """Whether the minimum lies at a whole number of samples, by the parabola through it, over all periods."""
    if not 0 < at < len(difference) - 1:
        return True
    left, middle, right = difference[at - 1 : at + 2]
    curvature = left - 2 * middle + right
    offset = 0.5 * (left - right) / curvature if curvature > 0 else 0.0
    return abs(offset) * periods < max(_FRACTION * periods, 0.25)
