"""The three numbers of an uncalibrated robot in a report: as declared, best-fit registered, and the robot's own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.calibration.verification import DECLARED, NOMINAL, MeasuredPoints
from flexcal.report.layout import ErrorRange, Table, document_millimetres, statistics_cells
from flexcal.report.sections.first_screen import error_range
from flexcal.report.sections.measured_words import POINTS, MeasuredWords


def uncalibrated_rows(points: MeasuredPoints) -> list[tuple[str, ...]]:
    """Label, number of points, mean, P90 and maximum in mm of all three; dashes where one is not known."""
    rows = []
    for model, label in MeasuredWords.of(points.poses).before.items():
        statistics = points.statistics(model) if model in points.errors else None
        count = str(len(points.poses)) if statistics else ""
        rows.append((label, count, *statistics_cells(statistics)))
    return rows


def uncalibrated_table(before: Mapping[str, Mapping[str, Any] | None]) -> Table:
    """The block `before` of a document as a table."""
    labels = {"registered" if name == NOMINAL else name: label for name, label in POINTS.before.items()}
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
        note=POINTS.note,
    )


def uncalibrated_ranges(points: MeasuredPoints) -> list[ErrorRange]:
    """The error range of the best-fit registered robot, and that of the robot's own error, as far as they are known."""
    return [
        error_range(label.partition(" (")[0], points.statistics(model), "nominal")
        for model, label in MeasuredWords.of(points.poses).before.items()
        if model in points.errors and model != DECLARED
    ]
