"""What is to be expected of a robot of a fleet: all that its errors, its geometry and its rechecks say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

_NAMED = 3


def outlook_of(robot: Mapping[str, Any], errors: str, geometry: Mapping[str, Any] | None) -> str:
    """Clauses on an entry of the document's `robots`: what changed, or where nothing did, what was tested and what could not be; `errors`
    is that on the trend of its errors, `geometry` its entry of `geometry_drifts`.
    """
    unknown = [] if robot["not_tested"] is None else [f"geometry not tested: {robot['not_tested']}"]
    changes = list(_changes(robot, errors, geometry))
    return "; ".join([*(changes or _quiet(robot, errors)), *unknown])


def _changes(robot: Mapping[str, Any], errors: str, geometry: Mapping[str, Any] | None) -> Iterator[str]:
    rise, visit = robot["rise"], robot["recheck"]
    if robot["drifts"]:
        yield errors
    if rise is not None:
        yield (
            f"P90 rose from {rise['from_mm']:.3f} mm ({rise['first']}) to {rise['to_mm']:.3f} mm ({rise['last']})"
            + (
                f", which was {robot['warmth']}"
                if rise["last"] == robot["verified"] and robot["warmth"]
                else ""
            )
            + (": growth of the arm can explain it" if rise["by_warmth"] else "")
        )
    if geometry is not None:
        moved = geometry["tool_mm"]
        how = (
            f"jumped between {geometry['first']} and {geometry['last']}"
            if geometry["change"] == "step"
            else f"drifts over {geometry['visits']} calibrations"
        )
        by = "" if moved is None else f", the tool by {moved['largest']:.3f} mm at most"
        grows = (
            ", all lengths together, as by warmth or the scale of the instrument" if geometry["grows"] else ""
        )
        places = geometry["two_robots"]
        asked = "" if places is None else f": are {' and '.join(places)} two robots with one serial number?"
        load = ", as by a load that was not declared" if geometry["by_load"] else ""
        yield f"the geometry {how}{by}{grows}{load}{asked}"
    grown = geometry is not None and geometry["grows"]
    alike = geometry is None or geometry["two_robots"] is None
    if names := [n for n in robot["drifting_parameters"] if alike and not (grown and ".length_" in n)]:
        yield f"{', '.join(names[:_NAMED])}{' and others' if len(names) > _NAMED else ''}: drifts"
    if visit is not None and visit["changed"]:
        yield f"not as calibrated by the recheck of {visit['date']}: {visit['verdict'].replace('_', ' ')}"
    if visit is not None and visit["alarms"]:
        yield f"slow drift of {', '.join(visit['alarms'])} by the rechecks up to {visit['date']}"


def _quiet(robot: Mapping[str, Any], errors: str) -> Iterator[str]:
    yield errors
    if robot["geometry_tested"]:
        yield "no significant trend of the geometry"
    if robot["recheck"] is not None and robot["recheck"]["verdict"] == "as_calibrated":
        yield f"as calibrated by the recheck of {robot['recheck']['date']}"
