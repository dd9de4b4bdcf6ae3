"""Table of the robots of a fleet for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table

from flexcal.cli.tables.results import NOTHING
from flexcal.report.results import TOLERANCE_STATES, is_drifting, tolerance_kept

_LISTED = 20


def fleet_table(document: Mapping[str, Any]) -> Table:
    """Robots with their P90 and trend, those that need attention first, twenty at most."""
    order = list(TOLERANCE_STATES)
    robots = sorted(
        document["robots"],
        key=lambda r: (not is_drifting(r) and r["state"] != "out", order.index(r["state"])),
    )
    left = len(robots) - _LISTED
    title = "robots" if left <= 0 else f"robots, those that need attention first; {left} more are on the page"
    table = Table(title=title, title_justify="left")
    for heading in ("robot", "model", "verified"):
        table.add_column(heading, overflow="fold")
    for heading in ("p90 mm", "tolerance mm"):
        table.add_column(heading, justify="right")
    for heading in ("tolerance", "outlook"):
        table.add_column(heading)
    for robot in robots[:_LISTED]:
        p90, tolerance = (robot[key] for key in ("p90_mm", "tolerance_mm"))
        table.add_row(
            robot["robot"],
            robot["model"],
            robot["verified"] or NOTHING,
            NOTHING if p90 is None else f"{p90:.3f} ± {robot['p90_std_mm']:.3f}",
            NOTHING if tolerance is None else f"{tolerance:.3f}",
            tolerance_kept(robot),
            robot["outlook"],
        )
    return table
