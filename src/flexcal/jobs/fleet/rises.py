"""Rise of a robot's errors between one verification and the next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from flexcal.fleet import holm
from flexcal.jobs.fleet.courses import Record, visits_of

_SHARE = 0.75
"""Share of all differences between a robot's verifications that one rise is: a trend has it spread over several."""
_FEWEST = 3
"""Number of other pairs of verifications from which their scatter is used."""
_FREEDOM = 6
"""Degrees of freedom of Student's t of a difference: the scatter differs between robots."""
_FACTOR = 2.0
"""Least factor of a rise: smaller ones come where the temperature, for instance, differs between verifications."""
_MEDIAN = 0.6745
"""Median of the absolute value of a standard normal variable."""


@dataclass(frozen=True)
class Rise:
    """P90 of errors, m, at a verification and at the next, where it is larger, and the p-value of no rise, corrected for their number."""

    dates: tuple[datetime, datetime]
    errors: tuple[float, float]
    probability: float


def error_rises(verifications: Mapping[str, Sequence[Record]], level: float) -> dict[str, Rise]:
    """Rises that are significant at the `level`, of robots by name, between two verifications of one calibration on different days.

    Logarithms of P90s are compared with their standard deviations, times the scatter of all other pairs (median absolute deviation) where
    that is more, by Student's t; p-values are corrected for all pairs of the fleet (Holm). Only one to twice the P90 or more, that is
    most of all differences between a robot's verifications and has not gone again by the last, is a rise.
    """
    from scipy.special import stdtr

    pairs: list[tuple[str, Rise, float]] = []
    for robot, records in verifications.items():
        visits = visits_of(records)
        if len(visits.dates) < 2:
            continue
        logs, std = np.log(visits.values), visits.std / visits.values
        scores = np.diff(logs) / np.hypot(std[:-1], std[1:])
        for k, score in enumerate(scores):
            before, after = visits.values[k : k + 2]
            lasting = visits.values[-1] > (before + after) / 2
            largest = (
                lasting and after >= _FACTOR * before and after - before >= _SHARE * np.ptp(visits.values)
            )
            rise = Rise(
                (visits.dates[k], visits.dates[k + 1]),
                (float(before), float(after)),
                1.0,
            )
            pairs.append((robot if largest else "", rise, float(score)))
    scores = np.array([score for _, _, score in pairs])
    probabilities = []
    for k, score in enumerate(scores):
        others = np.abs(np.delete(scores, k))
        scale = max(1.0, float(np.median(others)) / _MEDIAN) if len(others) >= _FEWEST else 1.0
        probabilities.append(float(stdtr(_FREEDOM, -score / scale)))
    found: dict[str, Rise] = {}
    for (robot, rise, _), p in zip(pairs, holm(probabilities), strict=True):
        if robot and p <= level:
            found[robot] = Rise(rise.dates, rise.errors, float(p))
    return found
