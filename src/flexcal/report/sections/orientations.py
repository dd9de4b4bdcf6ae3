"""Errors of measured orientations, before and after."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import NOTHING, Table

_NOTE = (
    "Angle between the measured axes of the target and the predicted ones. How the target is turned on the tool is fitted to the measured "
    "orientations, as one rotation: before, always; calibrated, with the parameters of the calibration{placed}."
)
_PLACED = ", or, where it measured no orientation, to those of this table"


def orientation_tables(block: Mapping[str, Any] | None) -> tuple[Table, ...]:
    """Table of the block `orientation` of results.json; none without measured orientations."""
    if block is None:
        return ()
    rows = []
    for label, key in (("before, best-fit registered", "before"), ("calibrated", "calibrated")):
        row = block[key]
        if row is not None:
            numbers = (f"{row[name]:.4f}" for name in ("mean_deg", "p90_deg", "max_deg", "rms_deg"))
            expected = row["expected_rms_deg"]
            rows.append(
                (label, str(row["poses"]), *numbers, NOTHING if expected is None else f"{expected:.4f}")
            )
    columns = ("model", "poses", "mean / °", "P90 / °", "max / °", "rms / °", "predicted rms / °")
    note = _NOTE.format(placed=_PLACED if block["calibrated"]["placed"] else "")
    return (Table("table-orientation", "Errors of the orientations", columns, tuple(rows), note=note),)
