"""Latest recheck of every robot of a fleet."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from flexcal.fleet import holm
from flexcal.jobs.fleet.courses import Record


@dataclass(frozen=True)
class LatestRecheck:
    """Verdict and sentence of the latest visit, the probability that a robot as calibrated looks so, alone and corrected for the number of
    robots, and joints whose cumulative sums gave an alarm.
    """

    date: datetime
    verdict: str
    sentence: str
    probability: float
    adjusted: float
    alarms: tuple[str, ...]


def latest_rechecks(records: Sequence[Record]) -> dict[str, LatestRecheck]:
    """Latest recheck by robot, of those that were visited."""
    visits: dict[tuple[str, str, datetime], dict[str, Record]] = defaultdict(dict)
    for r in records:
        if r["kind"] == "recheck" and r["name"] in ("changed", "probability", "alarms"):
            visits[r["robot"], r["file"], r["date"]][r["name"]] = r
    last: dict[str, dict[str, Record]] = {}
    for (robot, _, _), visit in sorted(visits.items(), key=lambda item: item[0][2]):
        last[robot] = visit
    adjusted = holm([visit["probability"]["value"] for visit in last.values()])
    return {
        robot: LatestRecheck(
            visit["changed"]["date"],
            visit["probability"]["text"],
            visit["changed"]["text"],
            visit["probability"]["value"],
            float(p),
            tuple(visit["alarms"]["text"].split()),
        )
        for (robot, visit), p in zip(last.items(), adjusted, strict=True)
    }
