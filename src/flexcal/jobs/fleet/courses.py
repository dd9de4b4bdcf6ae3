"""Courses of a robot's results over time, from the table of a fleet."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from typing import Any

import numpy as np

from flexcal.fleet import FEWEST_VISITS, Course

_YEAR = timedelta(days=365.25)
_EPOCH = datetime(2000, 1, 1)

Record = dict[str, Any]
"""A row of the table by column."""


@dataclass(frozen=True, eq=False)
class Visits:
    """Values (K,) of a quantity and their standard deviations (K,) on K different days, `dates` in their order."""

    dates: tuple[datetime, ...]
    values: np.ndarray
    std: np.ndarray

    @property
    def many(self) -> bool:
        """Whether there are enough for a trend."""
        return len(self.dates) >= FEWEST_VISITS

    @property
    def span(self) -> float:
        """From the first to the last, years."""
        return years(self.dates[-1]) - years(self.dates[0])

    def course(self, family: object) -> Course:
        """As a course over years."""
        return Course(np.array([years(d) for d in self.dates]), self.values, self.std, family)


def visits_of(records: Iterable[Record]) -> Visits:
    """Visits of one quantity. Of results from the same measurements the latest counts, and results of one day are one visit: their mean,
    with the uncertainty of one of them.
    """
    dated = sorted((r for r in records if r["date"] is not None), key=lambda r: r["date"])
    days: dict[date, list[Record]] = {}
    for record in {r["data"] or r["file"]: r for r in dated}.values():
        days.setdefault(record["date"].date(), []).append(record)
    groups = [days[day] for day in sorted(days)]
    return Visits(
        tuple(group[0]["date"] for group in groups),
        np.array([np.mean([r["value"] for r in group]) for group in groups]),
        np.array([np.sqrt(np.mean([r["std"] ** 2 for r in group])) for group in groups]),
    )


def years(when: datetime) -> float:
    """Years since 2000."""
    return (when - _EPOCH) / _YEAR


def date_at(time: float) -> datetime | None:
    """Date at so many years since 2000; None beyond the calendar."""
    try:
        return _EPOCH + time * _YEAR
    except (OverflowError, ValueError):
        return None


def latest(records: Sequence[Record]) -> Record:
    """The record with the latest date; where none has one, that of the file that was changed last."""
    return max(records, key=lambda r: (r["date"] is not None, r["date"] or r["modified"], r["modified"]))
