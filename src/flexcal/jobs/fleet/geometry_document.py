"""Entries of a fleet's JSON document on the drift of robots' geometry, and the sentence of each."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from flexcal.calibration.comparison import GROWTH
from flexcal.jobs.fleet.courses import years
from flexcal.jobs.fleet.geometry_drifts import GeometryDrift
from flexcal.report.results import explanation_in_words
from flexcal.units import MILLIMETRE

_LOAD = "; joints that yield to a load that was not declared explain it as well: check what the robot carried then"
_SMALL = 0.2
"""Largest movement of the tool, over the tolerance, that is called small."""


def geometry_entry(drift: GeometryDrift, tolerance: float | None) -> dict[str, Any]:
    """A robot's drift: changes from the first to the last calibration in SI units, movements of the tool in mm."""
    course, test = drift.course, drift.test
    before, after = _dates(drift)
    span = years(after) - years(before)
    along = course.trend if drift.step is None else course.steps[drift.step]
    units = dict(zip(along.names, along.units, strict=True))
    return {
        "robot": course.robot,
        "model": course.model,
        "visits": len(course.dates),
        "change": "trend" if drift.step is None else "step",
        "first": before.date().isoformat(),
        "last": after.date().isoformat(),
        "combinations": len(along.change),
        "scatter": test.scale**0.5,
        "freedom": test.freedom,
        "probability": test.probability,
        "adjusted_probability": drift.probability,
        "explanations": [
            {
                "name": item.subject,
                "unit": units[item.subject],
                "change": sum(item.change),
                "std": sum(item.std),
                "per_year": sum(item.change) / span if drift.step is None else None,
                "per_year_std": sum(item.std) / span if drift.step is None else None,
                "alternatives": list(item.alternatives),
            }
            for item in (drift.explanations if drift.two_robots is None else ())
        ],
        "two_robots": drift.two_robots,
        "grows": _grows(drift),
        "by_load": drift.by_load,
        "temperatures": None if course.trend.temperatures is None else course.trend.temperatures.tolist(),
        "tool_mm": None
        if drift.moved is None
        else dict(zip(("mean", "mean_std", "largest"), (m / MILLIMETRE for m in drift.moved), strict=True)),
        "sentence": _sentence(drift, tolerance),
    }


def _dates(drift: GeometryDrift) -> tuple[datetime, datetime]:
    """Of the first and the last calibration, or of those before and after a step."""
    before, after = drift.compared
    return drift.course.dates[before], drift.course.dates[after]


def _sentence(drift: GeometryDrift, tolerance: float | None) -> str:
    """What drifted or jumped by how much, and how far that moves the tool, with the tolerance (m) where there is one."""
    before, after = (date.date().isoformat() for date in _dates(drift))
    over = f"trend over {len(drift.course.dates)} calibrations"
    if drift.step is not None:
        over = f"jump between the calibrations of {before} and {after}"
    if drift.two_robots is not None:
        return (
            f"{over}, of no single cause: are {' and '.join(drift.two_robots)} two robots with one serial number? Give each robot.yaml its "
            "own; another arm in place of the first, or several changes at once, look the same"
        )
    if drift.moved is None:
        return (
            f"{over}, of no single parameter of a joint; "
            f"flexcal report --compare shows where the tool moved between two of them{_LOAD if drift.by_load else ''}"
        )
    changes = "; ".join(explanation_in_words(item) for item in drift.explanations)
    mean, std, largest = (m / MILLIMETRE for m in drift.moved)
    said = (
        f"{over}{', from the first to the last' if drift.step is None else ':'} {changes}: "
        f"this moves the tool by {mean:.3f} ± {std:.3f} mm on average, {largest:.3f} mm at most"
    )
    said += _of_temperature(drift) + (_LOAD if drift.by_load else "")
    if tolerance is None:
        return said
    limit = tolerance / MILLIMETRE
    if largest <= _SMALL * limit:
        return f"{said}; significant, but small beside the tolerance of {limit:.3g} mm"
    return f"{said}; the tolerance is {limit:.3g} mm"


def _grows(drift: GeometryDrift) -> bool:
    """Whether growth of all lengths may have caused all of the change."""
    return bool(drift.explanations) and all(
        GROWTH in (item.subject, *item.alternatives) for item in drift.explanations
    )


def _of_temperature(drift: GeometryDrift) -> str:
    """What temperatures have to do with a change, where they are known to differ, or may be its cause."""
    known = drift.course.trend.temperatures
    if known is not None and known.max() > known.min():
        return f"; growth with the temperature, {known.min():.3g} to {known.max():.3g} °C, is taken out of it"
    if not _grows(drift):
        return ""
    if known is not None:
        return "; the scale of the instrument, or an arm warmer than its sensor, explains growth of all lengths as well"
    return (
        "; a warmer arm, or the scale of the instrument, explains growth of all lengths as well, which the readings cannot tell: measure "
        "with a column temperature"
    )
