"""Resampled estimates of a study beside their stated uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import Section, Table, Text, scaled, significant


def resampling_section(block: Mapping[str, Any]) -> Section:
    """Spread of the estimates over resampled data against the stated standard deviation, from `resampling` of results.json."""
    items = sorted(block["parameters"].items(), key=lambda item: -(item[1]["ratio"] or 0.0))
    rows = tuple(_row(name, item) for name, item in items)
    middle = "" if block["ratio"] is None else f"The median ratio is {significant(block['ratio'], 3)}. "
    how = (
        "Residuals are drawn anew among those of the same station: errors that are correlated between poses count as independent."
        if block["kind"] == "bootstrap"
        else "Groups of measurements are left out one after the other: errors that are common to a group count with it."
    )
    words = (
        f"Spread of the estimates over {block['resamples']} data sets against the standard deviation that the fit states. "
        f"{middle}{how}"
    )
    columns = ("parameter", "unit", "estimate", "stated std", f"{block['kind']} std", "ratio")
    return Section(
        "resampling",
        "Resampled data against stated uncertainty",
        "",
        (Text((words,)), Table("table-resampling", "Parameters, the largest ratio first", columns, rows)),
    )


def _row(name: str, item: Mapping[str, Any]) -> tuple[str, ...]:
    """A parameter in the unit in which pages print it; in one of the SI where its own is not known."""
    factor, unit = scaled(item["unit"] or "SI")
    estimate, std, spread = (factor * item[what] for what in ("estimate", "std", "spread"))
    return (
        name,
        unit,
        significant(estimate),
        significant(std, 3),
        significant(spread, 3),
        significant(item["ratio"], 3),
    )
