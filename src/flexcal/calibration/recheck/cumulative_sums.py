"""Cumulative sums over visits: slow drifts of single joints that no visit shows on its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from flexcal.calibration.recheck.global_test import FALSE_ALARM, VISIT_ALARM

AVERAGE_RUN = 1 / (FALSE_ALARM - VISIT_ALARM)
"""Average number of visits between two false alarms of all sums together: what the test of each visit leaves."""
ALLOWANCE = 0.25
"""Difference, in standard deviations, that a sum lets pass at each visit: small, for slow drifts; it finds twice that soonest."""
_STATES = 120


@dataclass(frozen=True)
class ShiftAtVisit:
    """Shift of `subject` estimated at a visit as if nothing else had changed, natural units: `std` is of its own noise, `common_std`
    of what the visits of one `series` share.
    """

    subject: str
    estimate: float
    std: float
    common_std: float
    series: str


@dataclass(frozen=True, eq=False)
class DriftSum:
    """Cumulative sums (Page 1954) of one subject over V visits, upward and downward, and the `limit` of an alarm.

    They add up what each visit differs from the mean of those before it, in standard deviations; that is independent from visit to visit,
    although all visits are compared with the same calibration or reference (Hawkins 1987). After an alarm a sum stays where it is.
    `alarm` is the index of the visit that passed the limit, None if none did; `since` that from which the sum grew.
    """

    subject: str
    upward: np.ndarray
    downward: np.ndarray
    limit: float
    alarm: int | None
    since: int | None

    @property
    def gradual(self) -> bool:
        """Whether the alarm is of several visits: half of the limit was passed before the visit of the alarm, which is no jump then."""
        if self.alarm is None or self.alarm == 0:
            return False
        return max(self.upward[self.alarm - 1], self.downward[self.alarm - 1]) > self.limit / 2


def drift_sums(visits: Sequence[Sequence[ShiftAtVisit]]) -> tuple[DriftSum, ...]:
    """Cumulative sums of every subject over visits in their order; what a visit does not see of a subject is left out.

    Visits that show a change on their own are to be given without shifts: these are estimated as if only their subject had changed.

    The limit is such that false alarms of all subjects together are `AVERAGE_RUN` visits apart on average, or more, as their sums are
    correlated (Brook and Evans 1972).
    """
    subjects = list(dict.fromkeys(item.subject for visit in visits for item in visit))
    if not subjects:
        return ()
    limit = decision_limit(AVERAGE_RUN * len(subjects))
    return tuple(_sum(subject, visits, limit) for subject in subjects)


def innovations(shifts: Sequence[ShiftAtVisit]) -> np.ndarray:
    """Differences (V,) of shifts from what those before let expect, in standard deviations: independent standard normal without a change.

    The common error u of a series has the variance `common_std`² at first and is learnt from visit to visit (Kalman 1960).
    """
    known: dict[str, tuple[float, float]] = {}
    result = []
    for item in shifts:
        mean, variance = known.get(item.series, (0.0, item.common_std**2))
        whole = variance + item.std**2
        result.append((item.estimate - mean) / np.sqrt(whole))
        gain = variance / whole
        known[item.series] = mean + gain * (item.estimate - mean), (1 - gain) * variance
    return np.array(result)


def _sum(subject: str, visits: Sequence[Sequence[ShiftAtVisit]], limit: float) -> DriftSum:
    place = [next((item for item in visit if item.subject == subject), None) for visit in visits]
    steps = np.zeros(len(visits))
    there = [k for k, item in enumerate(place) if item is not None]
    seen = [item for item in place if item is not None]
    steps[there] = innovations(seen)
    sums = np.zeros((2, len(visits)))
    value, alarm, since, start = np.zeros(2), None, None, np.zeros(2, dtype=int)
    for k in range(len(visits)):
        if k in there and alarm is None:
            start[value <= 0] = k
            value = np.maximum(0.0, value + np.array([steps[k], -steps[k]]) - ALLOWANCE)
            if value.max() > limit:
                alarm, since = k, int(start[int(value.argmax())])
        sums[:, k] = value
    return DriftSum(subject, sums[0], sums[1], limit, alarm, since)


@lru_cache
def decision_limit(average_run: float) -> float:
    """Limit of a pair of sums, upward and downward, whose false alarms are `average_run` visits apart on average."""
    from scipy.optimize import brentq

    return float(brentq(lambda h: np.log(run_length(h) / 2 / average_run), 1.0, 20.0))  # pyright: ignore[reportArgumentType]


def run_length(limit: float, allowance: float = ALLOWANCE) -> float:
    """Average number of visits until one sum of standard normal values passes a limit, by a Markov chain (Brook and Evans 1972)."""
    from scipy.special import ndtr

    width = 2 * limit / (2 * _STATES - 1)
    centre = np.arange(_STATES) * width
    upper = centre[None] + width / 2 - centre[:, None] + allowance
    moves = ndtr(upper) - ndtr(upper - width)
    moves[:, 0] = ndtr(width / 2 - centre + allowance)
    return float(np.linalg.solve(np.eye(_STATES) - moves, np.ones(_STATES))[0])
