"""Frequency band in which an excitation determines a frequency response."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from flexcal.frequency.arbitrary.nonparametric import LocalResponse
from flexcal.frequency.arbitrary.spectra import RecordSpectra
from flexcal.frequency.periodic import LocalWindows, projected

_TAIL = 1e-3
"""Share of the input's power beyond either end of the band."""
_KNOWN = 0.25
"""Relative standard deviation below which a line counts as determined."""
_SMOOTHED = 7
_SMOOTH = 0.15
"""Least share of the input's power that is not smooth over frequency."""
_ABSENT = 0.5
"""Penalty for a line that is not determined, where a determined one counts 1."""


def excited_band(
    spectra: RecordSpectra, response: LocalResponse, usable: np.ndarray | None = None
) -> tuple[float, float] | None:
    """Lowest and highest frequency (Hz) of the stretch with most determined lines, within nearly all of the input's power.

    None where hardly any line is determined.

    A line is determined where an output responds to an input with a standard deviation well below the response of its neighbourhood, so
    that an antiresonance counts as well, and where its bin is `usable` (K,): most of its neighbours' input must not be fed-back noise.
    Near the end of a sweep the input is as smooth over frequency as a transient, and its response cannot be told from one.
    """
    level = median_filter(np.abs(response.response), size=(_SMOOTHED, 1, 1), mode="nearest")
    relative = median_filter(
        response.std / np.maximum(level, np.finfo(float).tiny), size=(_SMOOTHED, 1, 1), mode="nearest"
    )
    power = np.cumsum((np.abs(spectra.instruments) ** 2).sum((0, 2)))
    low, high = (
        float(np.interp(share * power[-1], power, spectra.frequencies_hz)) for share in (_TAIL, 1 - _TAIL)
    )
    inside = (response.frequencies_hz >= low) & (response.frequencies_hz <= high)
    determined = (relative < _KNOWN).any((1, 2)) & inside
    at = np.searchsorted(spectra.frequencies_hz, response.frequencies_hz - 1e-9)
    if not spectra.settled:
        determined &= _rough(spectra, at, round(response.correlated_hz / spectra.resolution_hz)) > _SMOOTH
    if usable is not None:
        determined &= median_filter(usable[at], size=_SMOOTHED, mode="nearest")
    score = np.where(determined, 1.0, -_ABSENT)
    total = np.concatenate([[0.0], np.cumsum(score)])
    lowest = np.minimum.accumulate(total[:-1])
    end = int(np.argmax(total[1:] - lowest))
    first = int(np.argmin(total[: end + 1]))
    if determined[first : end + 1].sum() < _SMOOTHED:
        return None
    return float(response.frequencies_hz[first]), float(response.frequencies_hz[end])


def _rough(spectra: RecordSpectra, at: np.ndarray, width: int) -> np.ndarray:
    """Share (L,) of the power about the bins `at` (L,) that a polynomial over a window does not explain; largest over the inputs."""
    windows = LocalWindows.of(at, len(spectra.frequencies_hz), width)
    seen = windows.seen(spectra.instruments)
    left = seen - projected(windows.smooth, seen)
    power, rough = ((np.abs(values) ** 2).sum((1, 2)) for values in (seen, left))
    return (rough / np.maximum(power, np.finfo(float).tiny)).max(1)
