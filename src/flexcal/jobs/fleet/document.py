"""JSON document of a fleet, which its page is made from (docs/file-formats.md)."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from flexcal.jobs.fleet.accuracy import RobotAccuracy
from flexcal.jobs.fleet.courses import years
from flexcal.jobs.fleet.drifts import Drift
from flexcal.jobs.fleet.gathering import GatheredFleet
from flexcal.jobs.fleet.geometry_document import geometry_entry
from flexcal.jobs.fleet.geometry_drifts import GeometryDrift
from flexcal.jobs.fleet.outlooks import outlook_of
from flexcal.jobs.fleet.parameters import ParameterSpread
from flexcal.jobs.fleet.rechecks import LatestRecheck
from flexcal.jobs.fleet.warmth import growth_remark, warm_remarks
from flexcal.jobs.fleet_prior import comparable_terms
from flexcal.report.layout import counted, listed
from flexcal.report.results import TOLERANCE_STATES, is_drifting
from flexcal.units import MILLIMETRE

_NAMED = 5
"""Largest number of robots that the headline names."""


def fleet_document(
    place: str,
    gathered: GatheredFleet,
    accuracies: Sequence[RobotAccuracy],
    drifts: Sequence[Drift],
    geometry: Sequence[GeometryDrift],
    spreads: Sequence[ParameterSpread],
    rechecks: Mapping[str, LatestRecheck],
    declared: Mapping[str, float | None],
    level: float,
    command: str,
) -> dict[str, Any]:
    """All numbers of a fleet: lengths with `_mm` in mm, values of parameters in SI units, slopes per year."""
    serials = {project.robot: project.serial for project in gathered.projects}
    results = gathered.table.frame.select("robot", "folder", "kind").unique().group_by("robot").len()
    counts = dict(results.iter_rows())
    found = [drift for drift in drifts if drift.probability <= level]
    by_robot: dict[str, list[Drift]] = defaultdict(list)
    for drift in found:
        by_robot[drift.robot].append(drift)
    tolerances = {item.robot: item.tolerance for item in accuracies}
    moving = sorted(
        (item for item in geometry if item.probability <= level), key=lambda item: item.probability
    )
    entries = [geometry_entry(item, tolerances.get(item.course.robot)) for item in moving]
    of_geometry = {item.course.robot for item in geometry}
    changes = {entry["robot"]: entry for entry in reversed(entries)}
    tested_parameters = Counter(drift.robot for drift in drifts)
    robots = [
        {
            "robot": item.robot,
            "model": item.model,
            "serial": serials.get(item.robot),
            "results": counts.get(item.robot, 0),
            **_accuracy(item, declared.get(item.robot), level),
            "recheck": _recheck(rechecks.get(item.robot), level),
            "parameter_trends": tested_parameters[item.robot],
            "drifting_parameters": [drift.name for drift in by_robot[item.robot]],
            "geometry_tested": item.robot in of_geometry,
            "geometry_drift": changes[item.robot]["sentence"] if item.robot in changes else None,
            "not_tested": gathered.untested.get(item.robot),
            "outlying_parameters": [
                spread.name
                for spread in spreads
                for outlier in spread.outliers
                if spread.robots[outlier.number] == item.robot
            ],
        }
        for item in accuracies
    ]
    robots = [
        {**robot, "outlook": outlook_of(robot, item.outlook, changes.get(item.robot))}
        for robot, item in zip(robots, accuracies, strict=True)
    ]
    states = Counter(str(robot["state"]) for robot in robots)
    tested = [item for item in accuracies if item.drift is not None]
    return {
        "place": place,
        "headline": _headline(robots, states, _folders(gathered)),
        "counts": {
            "robots": len(robots),
            "models": len({(project.model, project.urdf) for project in gathered.projects}),
            "results": sum(counts.values()),
            "rows": gathered.table.frame.height,
            **{state: states[state] for state in ("out", "within", "undecided", "not_judged")},
            "drifting": sum(is_drifting(robot) for robot in robots),
            "error_trends_tested": len(tested),
            "parameter_trends_tested": len(drifts),
            "robots_with_parameter_trends": len({drift.robot for drift in drifts}),
            "geometry_trends_tested": len(of_geometry),
            "geometry_drifting": len(changes),
            "geometry_not_tested": len(gathered.untested),
            "rechecked": len(rechecks),
            "changed": sum(r["recheck"] is not None and r["recheck"]["changed"] for r in robots),
            "reaching_tolerance": sum(robot["reaches"] is not None for robot in robots),
            "problems": len(gathered.problems),
        },
        "level": level,
        "robots": robots,
        "parameter_drifts": [_drift(drift) for drift in sorted(found, key=lambda drift: drift.probability)],
        "geometry_drifts": entries,
        "parameters": [_spread(spread) for spread in spreads],
        "problems": [{"place": p.place, "sentence": p.sentence} for p in gathered.problems],
        "batches": [item.document() for item in gathered.batches],
        "remarks": [
            *_remarks(gathered, accuracies, spreads),
            *growth_remark(geometry, level),
            *warm_remarks(accuracies),
        ],
        "command": command,
    }


def _folders(gathered: GatheredFleet) -> int:
    """Number of project folders, those of one robot's visits as one: as many as robots, unless several have one serial."""
    return len({project.place for project in gathered.projects})


def _headline(robots: Sequence[Mapping[str, Any]], states: Mapping[str, int], folders: int) -> str:
    many = counted(len(robots), "robot")
    if folders > len(robots):
        many += f" in {folders} folders, by their serials"
    if all(robot["tolerance_mm"] is None for robot in robots):
        many += "; no tolerance is stated, so none is judged"
    else:
        words = [f"{states.get(state, 0)} {label}" for state, label in TOLERANCE_STATES.items()]
        many += f": {', '.join(words)}"
    for what, named in (
        ("drifting or changed", [robot["robot"] for robot in robots if is_drifting(robot)]),
        ("verified at another temperature", [robot["robot"] for robot in robots if robot["warmth"]]),
        ("geometry not tested", [robot["robot"] for robot in robots if robot["not_tested"] is not None]),
    ):
        if named:
            many += f"; {what}: {listed(named, _NAMED)}"
    return many


def _accuracy(item: RobotAccuracy, declared: float | None, level: float) -> dict[str, Any]:
    verification, drift = item.verification, item.drift
    source = None if item.tolerance is None else "option" if declared is None else "robot.yaml"
    date, low, high = item.reached
    return {
        "state": item.state,
        "reason": item.reason,
        "tolerance_mm": _millimetres(item.tolerance),
        "tolerance_from": source,
        "p90_mm": None if verification is None else _millimetres(verification["value"]),
        "p90_std_mm": None if verification is None else _millimetres(verification["std"]),
        "verified": None if verification is None else _day(verification["date"]),
        "warmth": None if item.warmth is None else item.warmth.words or None,
        "drifts": drift is not None and drift.probability <= level,
        "drifts_by_warmth": item.warm_drift,
        "trend": None if drift is None else _trend(drift, MILLIMETRE, "mm"),
        "rise": None
        if item.rise is None
        else {
            "first": _day(item.rise.dates[0]),
            "last": _day(item.rise.dates[1]),
            "from_mm": _millimetres(item.rise.errors[0]),
            "to_mm": _millimetres(item.rise.errors[1]),
            "by_warmth": item.warm_rise,
            "adjusted_probability": item.rise.probability,
        },
        "rises_tested": item.rises_tested,
        "reaches": None
        if item.reaches is None
        else {"date": _day(date), "low": _day(low), "high": _day(high)},
    }


def _recheck(visit: LatestRecheck | None, level: float) -> dict[str, Any] | None:
    """The latest recheck; `changed` where that is significant after correction for the number of robots."""
    if visit is None:
        return None
    return {
        "date": _day(visit.date),
        "verdict": visit.verdict,
        "sentence": visit.sentence,
        "probability": visit.probability,
        "adjusted_probability": visit.adjusted,
        "changed": visit.verdict != "as_calibrated" and visit.adjusted <= level,
        "alarms": list(visit.alarms),
    }


def _trend(drift: Drift, scale: float, unit: str) -> dict[str, Any]:
    low, high = drift.trend.slope_interval(0.95)
    return {
        "visits": len(drift.visits.dates),
        "first": _day(drift.visits.dates[0]),
        "last": _day(drift.visits.dates[-1]),
        "unit": unit,
        "per_year": drift.trend.slope / scale,
        "low": low / scale,
        "high": high / scale,
        "probability": drift.trend.probability,
        "adjusted_probability": drift.probability,
        "dates": [_day(date) for date in drift.visits.dates],
        "values": (drift.visits.values / scale).tolist(),
        "std": (drift.visits.std / scale).tolist(),
        "line": [
            drift.trend.at(years(date)) / scale for date in (drift.visits.dates[0], drift.visits.dates[-1])
        ],
    }


def _drift(drift: Drift) -> dict[str, Any]:
    return {"robot": drift.robot, "model": drift.model, "kind": drift.kind, "name": drift.name} | _trend(
        drift, 1.0, drift.unit
    )


def _spread(spread: ParameterSpread) -> dict[str, Any]:
    distribution = spread.distribution
    return {
        "model": spread.model,
        "urdf": spread.urdf,
        "kind": spread.kind,
        "name": spread.name,
        "unit": spread.unit,
        "absorbs": spread.absorbs.split(),
        "terms": list(spread.terms),
        "robots": len(spread.robots),
        "mean": distribution.mean,
        "mean_std": distribution.mean_std,
        "spread": distribution.spread,
        "spread_low": distribution.spread_low,
        "spread_high": distribution.spread_high,
        "measurement_std": float((spread.std**2).mean() ** 0.5),
        "outliers": [
            {
                "robot": spread.robots[item.number],
                "value": float(spread.values[item.number]),
                "std": float(spread.std[item.number]),
                "score": item.score,
                "adjusted_probability": item.probability,
            }
            for item in spread.outliers
        ],
    }


def _remarks(
    gathered: GatheredFleet, accuracies: Sequence[RobotAccuracy], spreads: Sequence[ParameterSpread]
) -> list[str]:
    remarks = []
    frame = gathered.table.frame
    without = {item.robot for item in accuracies} - set(frame["robot"])
    copies = sorted(without & set(gathered.copied))
    if copies:
        copied = ", ".join(f"{name} ({gathered.copied[name]})" for name in copies)
        number = len(accuracies) - len(copies)
        remarks.append(
            f"the results of {counted(number, 'robot')} in the folders of {len(accuracies)}: those of {copied} are copies of another's, in "
            "brackets; measure these robots, or give both one `serial:` in robot.yaml"
        )
    remarks += [
        f"probably one robot in two folders, which counts once in the spreads over robots: {twin.sentence}; give both one `serial:` in "
        "robot.yaml"
        for twin in gathered.twins
    ]
    remarks += [item.sentence for item in gathered.batches]
    if bare := sorted(without - set(copies)):
        folders = "the folder" if len(bare) == 1 else "the folders"
        remarks.append(
            f"no results in {folders} of {listed(bare, _NAMED)}: give calibrate and verify an --out there"
        )
    undated = sorted(frame.filter(frame["date"].is_null())["folder"].unique())
    if undated:
        subject = (
            "1 folder of results has no date and counts"
            if len(undated) == 1
            else f"{len(undated)} folders of results have no date and count"
        )
        remarks.append(
            f"{subject} in no trend ({listed(undated, _NAMED)}): give folders "
            "of --out a name with the day of the measurement, as 2026-03-01"
        )
    if gathered.repeated:
        remarks.append(
            f"{gathered.repeated} results stand in several folders of a robot and count once, with their earliest date"
        )
    urdfs: dict[str, set[str]] = defaultdict(set)
    for model, urdf in frame.select("model", "urdf").unique().iter_rows():
        urdfs[model].add(urdf)
    for model, digests in sorted(urdfs.items()):
        if len(digests) > 1:
            remarks.append(
                f"{len(digests)} different URDFs have the name {model}; parameters are deviations from a URDF, so robots are compared with "
                "those of the same one"
            )
    terms: dict[str, set[str]] = defaultdict(set)
    for model, own in frame.filter(frame["terms"] != "").select("model", "terms").unique().iter_rows():
        terms[model].add(" ".join(comparable_terms(own)))
    for model, several in sorted(terms.items()):
        if len(several) > 1:
            remarks.append(
                f"calibrations of {model} have different terms ({'; '.join(sorted(several))}), and parameters are compared with those of "
                "the same ones: name the terms in robot.yaml, as geometry: {terms: [kinematic, gravity_compliance]}"
            )
    if len(accuracies) > 1 and not spreads:
        remarks.append(
            "no parameter is known of three robots of one model or more, so nothing is said of their spread"
        )
    return remarks


def _millimetres(value: float | None) -> float | None:
    return None if value is None else value / MILLIMETRE


def _day(date: datetime | None) -> str | None:
    return None if date is None else date.date().isoformat()
