"""Errors at groups of measurements that were left out of a calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import NOTHING, Section, Table, document_millimetres


def held_out_section(held_out: Mapping[str, Any]) -> Section:
    """Every group as a row; `held_out` is the block of results.json."""
    sockets = held_out["distance_mm"] is not None
    columns = [held_out["by"], "poses", "mean / mm", "P90 / mm", "max / mm"]
    rows = []
    for name, group in held_out["groups"].items():
        cells = [document_millimetres(group[key]) for key in ("mean_mm", "p90_mm", "max_mm")]
        rows.append([name, str(group["poses"]), *cells])
        if sockets:
            rows[-1].append(document_millimetres(group["distance_mm"]))
    rows.append(["mean of the groups", "", document_millimetres(held_out["mean_mm"]), NOTHING, NOTHING])
    if sockets:
        columns.append("known distance off by / mm")
        rows[-1].append(document_millimetres(held_out["distance_mm"]))
    wrong = held_out["outliers"]
    return Section(
        "held_out",
        "Errors outside the fit",
        f"Each group of equal '{held_out['by']}' was left out of a calibration on the others, with terms selected anew, and compared "
        "with it."
        + (
            " A fixture that is left out is placed by its own poses: a socket is the mean of the predicted positions of the ball in it. "
            "The robot and the ball stay as calibrated on the others."
            if sockets
            else ""
        )
        + (f" {wrong} outliers among lengths and contacts are in no group." if wrong else ""),
        (
            Table(
                "table-held-out",
                "Errors at groups that were left out",
                tuple(columns),
                tuple(tuple(row) for row in rows),
                strong=(len(rows) - 1,),
            ),
        ),
    )
