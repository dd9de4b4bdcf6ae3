"""Accuracy of every robot of a fleet against its tolerance, now and as its trend goes on."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Literal

import numpy as np

from flexcal.fleet import FEWEST_VISITS, Crossing, crossing
from flexcal.jobs.fleet.courses import Record, date_at, latest, visits_of, years
from flexcal.jobs.fleet.drifts import Drift, error_drifts
from flexcal.jobs.fleet.rises import Rise, error_rises
from flexcal.jobs.fleet.warmth import Warmth, explains, explains_trend, warmth_of

_ONE_SIDED = 1.645
"""Quantile of the normal distribution: a robot that keeps its tolerance is called out of it in 5 % of verifications at most."""
_LARGEST_EXTRAPOLATION = 2.0
"""How far a trend is extrapolated beyond the last visit, over the time from the first to the last."""

State = Literal["out", "within", "undecided", "not_judged"]


@dataclass(frozen=True, eq=False)
class RobotAccuracy:
    """Accuracy of a robot against its tolerance.

    `verification` is the record of the P90 of its latest usable verification, None without one; `state` says whether that keeps the
    `tolerance`, m, and `reason` why. `drift` is the trend of the P90, `reaches` when that reaches the tolerance, years since 2000;
    `outlook` says both in a clause. `rise` is a significant one between two verifications, `rises_tested` whether there are two.
    `warmth` is that of the latest verification, None where it is not known; `warm_drift` and `warm_rise` say whether growth with
    temperature explains the trend and the rise.
    """

    robot: str
    model: str
    tolerance: float | None
    verification: Record | None
    state: State
    reason: str
    drift: Drift | None
    reaches: Crossing | None
    outlook: str
    rise: Rise | None
    rises_tested: bool
    warmth: Warmth | None
    warm_drift: bool
    warm_rise: bool

    @property
    def reached(self) -> tuple[datetime | None, datetime | None, datetime | None]:
        """Date at which the trend reaches the tolerance, and the interval of that; None where there is none."""
        if self.reaches is None:
            return None, None, None
        return date_at(self.reaches.time), date_at(self.reaches.low), date_at(self.reaches.high)


def robot_accuracies(
    robots: dict[str, tuple[str, float | None]], records: Sequence[Record], level: float
) -> list[RobotAccuracy]:
    """Accuracy of all robots, whose model and tolerance (m) are given by name; drifts are significant at the `level`."""
    verified: dict[str, list[Record]] = defaultdict(list)
    left_out: dict[str, list[Record]] = defaultdict(list)
    moved = {r["file"]: r["text"] for r in records if r["name"] == "moved" and r["value"]}
    for r in records:
        if r["kind"] == "verification" and r["name"] == "error.p90" and r["value"] is not None and r["std"]:
            usable = r["independent"] and r["file"] not in moved
            (verified if usable else left_out)[r["robot"]].append(r)
    last = {robot: latest(group) for robot, group in verified.items()}
    same = {
        robot: [r for r in group if r["calibration"] == last[robot]["calibration"]]
        for robot, group in verified.items()
    }
    drifts, rises, every = error_drifts(same), error_rises(same, level), warmth_of(records)
    found = []
    for robot, (model, tolerance) in robots.items():
        verification, drift = last.get(robot), drifts.get(robot)
        newest = latest([*verified[robot], *left_out[robot]]) if robot in {*verified, *left_out} else None
        if newest is not None and newest["file"] in moved:
            state, reason = (
                "not_judged",
                f"by the latest verification the {moved[newest['file']]} moved since the calibration; repeat it with --refit",
            )
        else:
            state, reason = _state(verification, tolerance, len(left_out[robot]))
        warmth, rise = every.get(robot, {}), rises.get(robot)
        warm_drift = drift is not None and explains_trend(
            [time.date() for time in drift.visits.dates],
            warmth,
            np.array([years(time) for time in drift.visits.dates]),
            drift.trend.slope,
        )
        reaches, outlook = _outlook(same.get(robot, []), drift, tolerance, state, level, warm_drift)
        found.append(
            RobotAccuracy(
                robot,
                model,
                tolerance,
                verification,
                state,
                reason,
                drift,
                reaches,
                outlook,
                rise,
                len(visits_of(same.get(robot, [])).dates) > 1,
                _warmth(warmth, verification),
                warm_drift,
                rise is not None
                and explains(
                    warmth.get(rise.dates[0].date()),
                    warmth.get(rise.dates[1].date()),
                    rise.errors[1] - rise.errors[0],
                ),
            )
        )
    return found


def _state(verification: Record | None, tolerance: float | None, fitted: int) -> tuple[State, str]:
    """Whether the tolerance is kept, by the rule of ISO 14253-1: proven only where the uncertainty of the P90 does not matter."""
    if verification is None:
        return "not_judged", (
            "verified only at poses that its calibration was fitted to" if fitted else "no verification"
        )
    if tolerance is None:
        return "not_judged", "no tolerance"
    value, margin = verification["value"], _ONE_SIDED * verification["std"]
    if value - margin > tolerance:
        return "out", "P90 is above the tolerance by more than its uncertainty"
    if value + margin <= tolerance:
        return "within", "P90 is below the tolerance by more than its uncertainty"
    return "undecided", "P90 is nearer to the tolerance than its uncertainty; verify at more poses"


def _outlook(
    verifications: Sequence[Record],
    drift: Drift | None,
    tolerance: float | None,
    state: State,
    level: float,
    warm: bool,
) -> tuple[Crossing | None, str]:
    """When the tolerance is reached, where the data say it, and a sentence on the trend."""
    if drift is None:
        if not verifications:
            return None, "not judged"
        dated = len(visits_of(verifications).dates)
        return (
            None,
            f"too early for a trend: {dated} of {FEWEST_VISITS} dated verifications of the present calibration",
        )
    if drift.probability > level:
        return None, "no significant trend of the errors"
    if drift.trend.slope < 0:
        return None, "errors decrease"
    if warm:
        return (
            None,
            "errors increase as the verifications get farther from the temperature of the calibration, which can explain it, so no date is "
            "given",
        )
    if tolerance is None or state == "out":
        return None, "errors increase"
    reaches = crossing(drift.trend, tolerance)
    if reaches is None:
        return None, "errors increase; when they reach the tolerance cannot be told"
    ahead = reaches.time - years(drift.visits.dates[-1])
    if ahead > _LARGEST_EXTRAPOLATION * drift.visits.span:
        return None, (
            f"errors increase; the tolerance is farther ahead than {_LARGEST_EXTRAPOLATION:g} times the time observed, so no date is given"
        )
    date, low, high = (_day(time) for time in (reaches.time, reaches.low, reaches.high))
    return reaches, f"errors increase and reach the tolerance by {date} ({low} to {high}) if they go on so"


def _warmth(warmth: dict[date, Warmth], verification: Record | None) -> Warmth | None:
    if verification is None or verification["date"] is None:
        return None
    return warmth.get(verification["date"].date())


def _day(time: float) -> str:
    date = date_at(time)
    return "open" if date is None else date.date().isoformat()
