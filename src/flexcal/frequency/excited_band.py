"""Band in which an excitation determines a frequency response."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from flexcal.frequency.local_response import LocalResponse
from flexcal.frequency.record_spectra import RecordSpectra

_TAIL = 1e-3
"""Share of the input's power that is left out at either end."""
_KNOWN = 0.25
"""Relative standard deviation below which a line counts as determined."""
_SMOOTHED = 7
_ABSENT = 0.5
"""What a line that is not determined takes away, against what one that is brings."""


def excited_band(spectra: RecordSpectra, response: LocalResponse) -> tuple[float, float] | None:
    """Lowest and highest frequency (Hz) of the stretch with the most determined lines, within nearly all of the input's power.

    None where hardly any line is determined.

    A line is determined where an output responds to an input with a standard deviation well below the response of its neighbourhood, so
    that an antiresonance counts as well.
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
    score = np.where(determined, 1.0, -_ABSENT)
    total = np.concatenate([[0.0], np.cumsum(score)])
    lowest = np.minimum.accumulate(total[:-1])
    end = int(np.argmax(total[1:] - lowest))
    first = int(np.argmin(total[: end + 1]))
    if determined[first : end + 1].sum() < _SMOOTHED:
        return None
    return float(response.frequencies_hz[first]), float(response.frequencies_hz[end])
