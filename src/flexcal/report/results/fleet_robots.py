"""Robots of a fleet in the document of its verb: whether they keep their tolerance, in words, and which have trends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

TOLERANCE_STATES = {
    "out": "out of tolerance",
    "within": "within",
    "undecided": "too near to tell",
    "not_judged": "not judged",
}
"""Words for the `state` of a robot."""


def tolerance_kept(robot: Mapping[str, Any]) -> str:
    """Whether a robot of the document keeps its tolerance, and why that is not judged."""
    told = TOLERANCE_STATES[robot["state"]]
    if robot["state"] == "not_judged":
        return f"{told}: {robot['reason']}"
    return f"{told}, verified {robot['warmth']}" if robot["warmth"] else told


def with_trends(document: Mapping[str, Any]) -> Sequence[str]:
    """Robots of the document that were tested for a change: of their errors, a parameter or the geometry as a whole, or by a recheck."""
    return [
        robot["robot"]
        for robot in document["robots"]
        if robot["trend"] is not None
        or robot["rises_tested"]
        or robot["parameter_trends"]
        or robot["geometry_tested"]
        or robot["recheck"] is not None
    ]


def is_drifting(robot: Mapping[str, Any]) -> bool:
    """Whether a robot of the document changed significantly: its errors, beyond what warmth explains, a parameter or the geometry as a
    whole, or by its rechecks.
    """
    rise, visit = robot["rise"], robot["recheck"]
    return bool(
        (robot["drifts"] and not robot["drifts_by_warmth"])
        or (rise is not None and not rise["by_warmth"])
        or robot["drifting_parameters"]
        or robot["geometry_drift"]
        or (visit is not None and (visit["changed"] or visit["alarms"]))
    )
