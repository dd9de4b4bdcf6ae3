"""Agreement of the frequency responses of two halves of the records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.frequency.arbitrary.nonparametric import LocalResponse


@dataclass(frozen=True)
class HalfDifference:
    """`ratio`: rms of the difference over its standard deviation, 1 expected; `relative`: its median, relative to the response.

    `lines`: independent lines, about.
    """

    ratio: float
    relative: float
    lines: int


def half_difference(first: LocalResponse, second: LocalResponse) -> HalfDifference:
    """Difference between responses at the same lines; lines that share data count as one."""
    difference = np.abs(first.response - second.response)
    std = np.hypot(first.std, second.std)
    freedom = min(first.degrees_of_freedom, second.degrees_of_freedom)
    expected = freedom / max(freedom - 1, 1)
    ratio = np.sqrt(np.mean((difference / np.maximum(std, np.finfo(float).tiny)) ** 2) / expected)
    level = np.median(np.abs(first.response), axis=0)
    span = first.frequencies_hz[-1] - first.frequencies_hz[0]
    return HalfDifference(
        float(ratio), float(np.median(difference / level)), max(1, int(span / first.correlated_hz))
    )
