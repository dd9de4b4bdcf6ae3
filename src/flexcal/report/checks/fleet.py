"""Checks of a fleet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import Check, counted, significant
from flexcal.report.results import with_trends

_TELLING_VISITS = 4
"""Visits of a robot from which the absence of a trend tells something: three find few drifts."""


def fleet_checks(document: Mapping[str, Any]) -> tuple[Check, ...]:
    """The checks behind the verdict, from the document of the verb."""
    counts = document["counts"]
    many = counts["robots"]
    unknown = many - sum(robot["tolerance_mm"] is not None for robot in document["robots"])
    unverified = sum(robot["p90_mm"] is None for robot in document["robots"])
    checks = [
        Check(
            "Has every robot a tolerance?",
            "Yes."
            if not unknown
            else f"{unknown} of {many} have none: give tolerance: in robot.yaml, or --tolerance.",
            "good" if not unknown else "unknown" if unknown == many else "care",
        ),
        Check(
            "Was every robot verified at poses outside its calibration?",
            "Yes." if not unverified else f"{unverified} of {many} were not.",
            "good" if not unverified else "care",
        ),
    ]
    if counts["out"] or counts["within"] or counts["undecided"]:
        checks.append(
            Check(
                "Do all that could be judged keep their tolerance?",
                f"{counts['out']} do not; {counts['undecided']} are too near to tell."
                if counts["out"] or counts["undecided"]
                else "Yes.",
                "bad" if counts["out"] else "care" if counts["undecided"] else "good",
            )
        )
    checks.append(_check_drift(document))
    if counts["rechecked"]:
        checks.append(
            Check(
                "Are the robots as calibrated, by their latest recheck?",
                f"{counts['changed']} of {counts['rechecked']} are not." if counts["changed"] else "Yes.",
                "bad" if counts["changed"] else "good",
            )
        )
    if document["problems"]:
        checks.append(
            Check(
                "Could everything be read?",
                f"No: {counted(len(document['problems']), 'problem')} with files or folders, listed below.",
                "care",
            )
        )
    return tuple(checks)


def _check_drift(document: Mapping[str, Any]) -> Check:
    """Whether errors, single parameters or the geometry as a whole of a robot have a significant trend."""
    question, counts, tested = "Does any robot drift?", document["counts"], len(with_trends(document))
    if counts["drifting"]:
        return Check(question, f"{counts['drifting']} of {tested} that were tested do, or changed.", "care")
    trends = [robot["trend"] for robot in document["robots"] if robot["trend"] is not None]
    if not trends and not counts["parameter_trends_tested"] and not counts["geometry_trends_tested"]:
        return Check(question, "No robot has three dated visits.", "unknown")
    if not trends:
        answer = (
            "Neither single parameters nor the geometry as a whole, of "
            f"{counted(counts['geometry_trends_tested'], 'robot')}, have a significant trend, "
            "but no robot has three dated verifications of one calibration."
        )
        return Check(question, answer, "unknown")
    answer = (
        f"No significant trend of the errors of {counted(len(trends), 'robot')}; their 95 % intervals allow up to "
        f"{significant(max(trend['high'] for trend in trends), 2)} mm a year."
    )
    telling = min(trend["visits"] for trend in trends) >= _TELLING_VISITS
    return Check(question, answer, "good" if telling else "unknown")
