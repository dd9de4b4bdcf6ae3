"""Coverage of the intervals of a study."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexcal.report.figures import interval_coverage
from flexcal.report.layout import FigureBlock, Section, Table, Text, percent, significant
from flexcal.report.results import NOMINAL_COVERAGE

_DRAWN = 60
"""Largest number of parameters in a figure."""


def coverage_range(item: Mapping[str, Any]) -> str:
    """Limits of an interval of a share."""
    return f"{percent(item['low'])} to {percent(item['high'])}"


def coverage_section(covered: Mapping[str, Any]) -> Section:
    """Share of 95 % intervals that hold the true value, by parameter, from `coverage` of results.json."""
    items = sorted(covered["parameters"].items(), key=lambda item: item[1]["share"])
    rows = tuple(
        (name, percent(item["share"]), coverage_range(item), f"{item['inside']} of {item['tasks']}")
        for name, item in items
    )
    off = [name for name, item in items if not item["low"] <= NOMINAL_COVERAGE <= item["high"]]
    expected = (1 - NOMINAL_COVERAGE) * len(items)
    words = (
        f"{len(off)} of {len(items)} parameters have a share whose interval excludes 95 %; about {significant(expected, 2)} or fewer do so "
        "by chance. Tasks of one seed share the drawn robot and its noise, as the intervals of one task do: the intervals of these shares "
        "come from the scatter between seeds. True values of parameters that the data cannot tell apart are mapped into those that were "
        "kept."
    )
    drawn = items[:_DRAWN]
    figure = interval_coverage(
        [name for name, _ in drawn],
        *(np.array([item[what] for _, item in drawn]) for what in ("share", "low", "high")),
    )
    columns = ("parameter", "coverage", "95 % interval", "intervals")
    few = f" The {_DRAWN} lowest of {len(items)} are drawn." if len(items) > _DRAWN else ""
    return Section(
        "coverage",
        "Do the intervals hold the truth?",
        "",
        (
            FigureBlock(
                "figure-coverage",
                "Coverage of the 95 % intervals",
                figure,
                f"Bars are 95 % intervals of the share.{few}",
                "Coverage by parameter.",
            ),
            Text((words,)),
            Table("table-coverage", "Coverage by parameter", columns, rows, folded=True),
        ),
    )
