"""Since when a robot has changed, and whether at once or more and more, from all visits that are stored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any, Literal

import numpy as np

from flexcal.calibration.recheck import (
    AVERAGE_RUN,
    VisitCourse,
    VisitErrors,
    errors_from_calibration,
    errors_from_reference,
    visit_courses,
)
from flexcal.data.poses import DEFAULT_SIGMA
from flexcal.jobs.recheck.change_intervals import change_intervals
from flexcal.jobs.recheck.visit_history import Visit
from flexcal.model.robot import RobotModel
from flexcal.report.results import amount
from flexcal.units import MILLIMETRE

_LEAST = 3
"""Least number of visits that tell a drift."""
_MONTH = 30.0
"""Days for which the rate of a drift is given where the visits span twice as many."""


@dataclass(frozen=True, eq=False)
class CourseOverVisits:
    """Courses of changes over the visits of these `dates`, the last one included, that explain all of them about equally well.

    `times` are the days of the visits, or their numbers where two have one date; `origin` is the date of the reference visit, None for a
    comparison with the calibration.
    """

    courses: tuple[VisitCourse, ...]
    dates: tuple[str, ...]
    times: tuple[float, ...]
    per: Literal["day", "visit"]
    origin: str | None

    @classmethod
    def of(
        cls, model: RobotModel, now: VisitErrors, when: str, before: Sequence[Visit], base: Visit | None
    ) -> CourseOverVisits:
        """Courses over the visits `before` and the one of today, `now`, all against the reference visit `base` or the calibration."""
        reference = None if base is None or now.compared == "calibration" else base
        told = [v for v in before if v is not reference and v.verdict != "wrong_reading"]
        pairs = [(v, _errors(model, v, reference)) for v in told]
        known = [(v.date, errors) for v, errors in pairs if errors is not None]
        dates = [*(day for day, _ in known), when]
        every = dates if reference is None else [reference.date, *dates]
        dated = len(set(every)) == len(every)
        clock = [float(date.fromisoformat(day).toordinal()) for day in every] if dated else range(len(every))
        times = tuple(float(value) for value in clock)
        origin = None if reference is None else times[0]
        times = times if reference is None else times[1:]
        courses = visit_courses([*(errors for _, errors in known), now], times, origin)
        return cls(
            courses,
            tuple(dates),
            times,
            "day" if dated else "visit",
            None if reference is None else reference.date,
        )

    @property
    def drifting(self) -> bool:
        """Whether something drifts, and no change at once explains the visits as well; by three visits, as two changes at once are alike to
        the drift of two.
        """
        return self._grows and all(len(self.dates) - item.first >= _LEAST for item in self.courses)

    @property
    def _grows(self) -> bool:
        return bool(self.courses) and all(item.kind == "drift" for item in self.courses)

    @property
    def sudden(self) -> bool:
        """Whether something changed at once, and no drift explains the visits as well."""
        return bool(self.courses) and all(item.kind == "step" for item in self.courses)

    @property
    def subjects(self) -> tuple[str, ...]:
        """What changed, the most likely first."""
        return tuple(dict.fromkeys(item.change.subject for item in self.courses))

    @property
    def drift_words(self) -> str:
        """The drifts with their rates, the likeliest first."""
        return ", or ".join(self._drift(item) for item in self.courses if item.kind == "drift")

    @property
    def since_words(self) -> str:
        """Since when the change is there, after what it is; empty where it came with the last visit or nothing tells it."""
        if not self.courses or self.drifting:
            return ""
        if self._grows:
            return (
                f"; that is more than at the visit of {self.dates[-2]}: it drifts, or changed a second time"
            )
        first = min(item.first for item in self.courses)
        last = len(self.dates) - 1
        if not self.sudden:
            return "; whether that came at once or grows from visit to visit, the visits do not tell yet"
        if first == last:
            return ""
        if first == 0 and self.origin is None:
            return f"; it was so at the first visit of {self.dates[0]} already, and the visits show no further change"
        before = self.dates[first - 1] if first > 0 else self.origin
        return f"; it came at once between the visits of {before} and {self.dates[first]}, and the visits since show no further change"

    def alarm_sentence(self, passed: Sequence[str]) -> str:
        """What sums that passed their limit say, where no visit shows it alone; `passed` are their subjects."""
        names = " or ".join(f"the {name}" if name == "payload" else name for name in passed)
        return (
            f"{self._alarm_words(names)}: that adds up beyond chance, though no visit shows it (cumulative sum; one false alarm in "
            f"{AVERAGE_RUN:.0f} visits; a tool or an instrument that creeps looks much the same)"
        )

    def _alarm_words(self, names: str) -> str:
        if not self.courses:
            return f"{names} seem{'' if ' or ' in names else 's'} to change from visit to visit, neither evenly nor at once"
        if self.drifting:
            return self.drift_words
        first = next(item.first for item in self.courses if item.kind == "step")
        before = self.dates[first - 1] if first > 0 else self.origin
        between = (
            f"before the visit of {self.dates[0]}"
            if before is None
            else f"between the visits of {before} and {self.dates[first]}"
        )
        at_once = f"changed at once {between}"
        if self.sudden:
            return f"{names} {at_once}"
        return f"{self.drift_words}, or {'' if len(self.subjects) == 1 else names + ' '}{at_once}"

    def document(self) -> list[dict[str, Any]]:
        """Block `drift.courses` of results.json."""
        return [
            {
                "kind": item.change.kind,
                "subject": item.change.subject,
                "course": item.kind,
                "since": self._since(item),
                "per": self.per if item.kind == "drift" else None,
                "changes": change_intervals(item),
                "remainder": item.remainder,
            }
            for item in self.courses
        ]

    def _since(self, item: VisitCourse) -> str | None:
        """Date of the last visit that a course does not concern, None where it began before all."""
        if item.first > 0:
            return self.dates[item.first - 1]
        return self.origin

    def _drift(self, item: VisitCourse) -> str:
        change = item.change
        span = self.times[-1] - self.times[0]
        per, unit = 1.0, f"a {self.per}"
        if self.per == "day" and span > 2 * _MONTH:
            per, unit = _MONTH, f"in {_MONTH:.0f} days"
        value, half = float(item.estimate[0]) * per, float(item.quantile * item.std[0]) * per
        since = self._since(item)
        start = "since before the first visit" if since is None else f"since the visit of {since}"
        passed = (self.times[-1] - item.since) / per
        if change.kind == "joint_shifted":
            unit_of = change.units[0]
            return (
                f"{change.subject} drifts by {amount(value, half, unit_of)} {unit} {start}, "
                f"{amount(value * passed, half * passed, unit_of)} by now"
            )
        if change.kind == "thermal_growth":
            return f"all lengths grow by {amount(1e6 * value, 1e6 * half, 'µm/m')} {unit} {start}, unless it is the scale of the instrument"
        if change.kind == "payload_changed":
            load = "payload" if change.subject == "payload" else f"load at {change.subject}"
            return f"the {load} changes by {amount(value, half, 'kg')} {unit} {start}"
        if change.kind == "joint_softer":
            told = amount(1e6 * value, 1e6 * half, "µrad/(N m)")
            return f"the compliance of {change.subject} changes by {told} {unit} {start}"
        size = float(np.linalg.norm(item.estimate[:3])) * per / MILLIMETRE
        half = float(item.quantile * np.linalg.norm(item.std[:3]) / np.sqrt(3)) * per / MILLIMETRE
        return f"{change.subject} creeps on its mount by {size:.3f} ± {half:.3f} mm {unit} {start}"


def _errors(model: RobotModel, visit: Visit, reference: Visit | None) -> VisitErrors | None:
    poses = visit.readings.poses(DEFAULT_SIGMA)
    if reference is None:
        return errors_from_calibration(model, poses, placed=visit.placed)
    return errors_from_reference(model, poses, reference.readings.poses(DEFAULT_SIGMA), placed=visit.placed)
