"""Trends of robots over time: of the errors that verifications found, and of parameters."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.comparison import ALUMINIUM
from flexcal.fleet import Trend, holm, moderated_trends
from flexcal.jobs.fleet.courses import Record, Visits, visits_of
from flexcal.jobs.fleet_prior import comparable_terms


@dataclass(frozen=True, eq=False)
class Drift:
    """Trend of one quantity of one robot, and the p-value of no trend corrected for all trends of the fleet that are tested with it."""

    robot: str
    model: str
    kind: str
    name: str
    unit: str
    visits: Visits
    trend: Trend
    probability: float


def error_drifts(verifications: dict[str, list[Record]]) -> dict[str, Drift]:
    """Trend of the P90 of every robot with three visits or more, by robot."""
    courses = {robot: visits_of(records) for robot, records in verifications.items()}
    return {
        drift.robot: drift
        for drift in _tested(
            [
                (verifications[robot][-1], visits, verifications[robot][-1]["model"])
                for robot, visits in courses.items()
                if visits.many
            ]
        )
    }


def parameter_drifts(records: Sequence[Record], families: int) -> list[Drift]:
    """Trend of every parameter of every robot with three visits or more, estimated with the same terms; its tests share the error rate with
    those of all `families` of tests. Lengths at temperatures between which a metre of aluminium grows by more than their uncertainty are
    not tested alone, but with the geometry as a whole, which the growth is taken out of.
    """
    groups: dict[tuple, list[Record]] = defaultdict(list)
    for r in records:
        key = (
            r["robot"],
            r["model"],
            r["urdf"],
            r["kind"],
            r["name"],
            r["absorbs"],
            comparable_terms(r["terms"]),
        )
        groups[key].append(r)
    found = []
    for key, group in groups.items():
        visits = visits_of(group)
        if visits.many and not (group[0]["unit"] == "m" and _grows(group)):
            found.append((group[-1], visits, key[1:]))
    return _tested(found, families)


def _grows(records: Sequence[Record]) -> bool:
    """Whether temperatures of a length's estimates differ by so much that its growth matters."""
    known = [r["temperature"] for r in records if r["temperature"] is not None]
    return len(known) > 1 and ALUMINIUM * float(np.ptp(known)) > min(r["std"] for r in records)


def _tested(courses: Sequence[tuple[Record, Visits, object]], families: int = 1) -> list[Drift]:
    trends = moderated_trends([visits.course(family) for _, visits, family in courses])
    adjusted = holm([trend.probability for trend in trends])
    return [
        Drift(
            r["robot"],
            r["model"],
            r["kind"],
            r["name"],
            r["unit"],
            visits,
            trend,
            min(1.0, families * float(p)),
        )
        for (r, visits, _), trend, p in zip(courses, trends, adjusted, strict=True)
    ]
