"""Temperatures of a robot's verifications, outside those of its calibration, and what errors they explain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import TYPE_CHECKING

import numpy as np

from flexcal.jobs.fleet.courses import Record
from flexcal.jobs.fleet.geometry_drifts import GeometryDrift
from flexcal.report.layout import listed
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.jobs.fleet.accuracy import RobotAccuracy

_TOLD = 2.0
"""Least difference of temperatures, K, that is spoken of."""
_NAMED = 5
"""Largest number of robots that a sentence names."""


@dataclass(frozen=True)
class Warmth:
    """How far a day's verification was `outside` the temperatures of its calibration, K, negative below them, and the `growth` of P90, m,
    of an arm of aluminium by that.
    """

    outside: float
    growth: float

    @property
    def words(self) -> str:
        """As “16 K warmer than the calibration”; empty where it is no warmer or colder."""
        if abs(self.outside) < _TOLD:
            return ""
        return f"{abs(self.outside):.2g} K {'warmer' if self.outside > 0 else 'colder'} than the calibration"


def warmth_of(records: Sequence[Record]) -> dict[str, dict[date, Warmth]]:
    """Warmth of all verifications where it is known, by robot and day."""
    values: dict[tuple[str, date, str], float] = {}
    for r in records:
        if r["name"] in ("temperature.outside", "error.growth") and r["date"] is not None:
            values[r["robot"], r["date"].date(), r["name"]] = r["value"]
    found: dict[str, dict[date, Warmth]] = {}
    for (robot, day, name), value in values.items():
        if name == "error.growth":
            outside = values[robot, day, "temperature.outside"]
            found.setdefault(robot, {})[day] = Warmth(outside, value)
    return found


def explains(before: Warmth | None, after: Warmth | None, rise: float) -> bool:
    """Whether growth explains that the P90 rose by so much, m, from one verification to another."""
    return before is not None and after is not None and rise <= after.growth - before.growth


def explains_trend(days: Sequence[date], warmth: dict[date, Warmth], times: np.ndarray, slope: float) -> bool:
    """Whether growth rises over times (K,) of verifications on some days as steeply as a trend of their P90."""
    if not all(day in warmth for day in days):
        return False
    growth = np.array([warmth[day].growth for day in days])
    return 0 < slope <= float(np.polyfit(times - times[0], growth, 1)[0])


def growth_remark(drifts: Sequence[GeometryDrift], level: float) -> list[str]:
    """A sentence on robots that grew with the temperature of their calibrations, and do not drift; none without any."""
    quiet: list[str] = []
    told: list[tuple[float, float]] = []
    degrees: list[float] = []
    for item in drifts:
        known, expansion = item.course.trend.temperatures, item.course.trend.expansion
        if item.probability > level and known is not None and expansion is not None and np.ptp(known) > _TOLD:
            quiet.append(item.course.robot)
            told.append(expansion)
            degrees += known.tolist()
    if not told:
        return []
    values, std = np.array(told).T
    mean, std = float(values @ std**-2) / float((std**-2).sum()), float((std**-2).sum()) ** -0.5
    size = (
        f"growth of about {1e6 * mean:.2g} µm/m per K of the measured temperature explains how their lengths differ"
        if mean > 2 * std
        else "their lengths do not differ by more than growth with that explains"
    )
    return [
        f"the calibrations of {listed(quiet, _NAMED)} were at {min(degrees):.3g} to {max(degrees):.3g} °C: "
        f"{size}, so it counts as no drift"
    ]


def warm_remarks(accuracies: Sequence[RobotAccuracy]) -> list[str]:
    """A sentence on robots whose latest verification was warmer or colder than the calibration; none without any."""
    away = [item for item in accuracies if item.warmth is not None and item.warmth.words]
    if not away:
        return []
    each = [
        f"{item.robot} {item.warmth.words}, by which aluminium grows by up to {item.warmth.growth / MILLIMETRE:.2g} mm at its points"
        for item in away[:_NAMED]
        if item.warmth is not None
    ]
    more = f", and {len(away) - _NAMED} more" if len(away) > _NAMED else ""
    return [
        f"verified at another temperature: {'; '.join(each)}{more}: that is part of the errors, so verify at the temperature of the "
        "calibration, or calibrate with the thermal term at several"
    ]
