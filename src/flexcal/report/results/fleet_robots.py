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
    return f"{told}: {robot['reason']}" if robot["state"] == "not_judged" else told


def with_trends(document: Mapping[str, Any]) -> Sequence[str]:
    """Robots of the document whose errors, a parameter or the geometry as a whole were tested for a trend."""
    return [
        robot["robot"]
        for robot in document["robots"]
        if robot["trend"] is not None or robot["parameter_trends"] or robot["geometry_tested"]
    ]


def is_drifting(robot: Mapping[str, Any]) -> bool:
    """Whether a robot of the document has a significant trend of its errors, of a parameter or of the geometry as a whole."""
    return bool(robot["drifts"] or robot["drifting_parameters"] or robot["geometry_drift"])
