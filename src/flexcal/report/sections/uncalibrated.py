"""The three numbers of an uncalibrated robot in a report: as declared, best-fit registered, and the robot's own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.calibration.verification import DECLARED, NOMINAL, OWN, MeasuredPoints
from flexcal.report.layout import ErrorRange, Table, document_millimetres, statistics_cells
from flexcal.report.sections.first_screen import error_range

BEFORE = {
    DECLARED: "before, as declared",
    NOMINAL: "before, best-fit registered",
    OWN: "before, the robot's own (registered, point found too)",
}

BEFORE_NOTE = (
    "As declared: with the measured point where robot.yaml says, in the declared frame; a dash where the instrument measures in a frame of "
    "its own. Best-fit registered: with the instrument's frame fitted (6 parameters a station). The robot's own: with the place of the "
    "measured point on the tool fitted too (3 a point), because an error of its declared place is not one of the robot."
)


def uncalibrated_rows(points: MeasuredPoints) -> list[tuple[str, ...]]:
    """Label, number of points, mean, P90 and maximum in mm of all three; dashes where one is not known."""
    rows = []
    for model, label in BEFORE.items():
        statistics = points.statistics(model) if model in points.errors else None
        count = str(len(points.poses)) if statistics else ""
        rows.append((label, count, *statistics_cells(statistics)))
    return rows


def uncalibrated_table(before: Mapping[str, Mapping[str, Any] | None]) -> Table:
    """The block `before` of a document as a table."""
    labels = dict(zip(("declared", "registered", "own"), BEFORE.values(), strict=True))
    rows = []
    for name, label in labels.items():
        block = before[name] or {}
        numbers = (document_millimetres(block.get(key)) for key in ("mean_mm", "p90_mm", "max_mm"))
        rows.append((label, *numbers))
    columns = ("model", "mean / mm", "P90 / mm", "max / mm")
    return Table(
        "table-before",
        "Errors at the verification poses before calibration",
        columns,
        tuple(rows),
        note=BEFORE_NOTE,
    )


def uncalibrated_ranges(points: MeasuredPoints) -> list[ErrorRange]:
    """The error range of the best-fit registered robot, and that of the robot's own error, as far as they are known."""
    labels = {NOMINAL: "best-fit registered", OWN: "the robot's own"}
    return [
        error_range(f"before, {label}", points.statistics(model), "nominal")
        for model, label in labels.items()
        if model in points.errors
    ]
