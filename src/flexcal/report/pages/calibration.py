"""The report of a calibration on measured poses (`flexcal calibrate`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flexcal.calibration.diagnostics import GravityLoads
from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.term_selection import CONDITIONAL, considered_terms
from flexcal.calibration.verification import CALIBRATED, RIGID, ArmPoses, MeasuredPoints, MeasuredTilts
from flexcal.estimation import Estimate
from flexcal.report.checks import Trust, calibration_checks, in_sockets
from flexcal.report.layout import (
    NOTHING,
    Page,
    Section,
    Status,
    Table,
    Text,
    Verdict,
    document_millimetres,
    millimetres,
    ratio,
    sentences,
    statistics_cells,
)
from flexcal.report.results import IdentifiableParameters
from flexcal.report.sections import (
    MeasuredWords,
    arm_figure,
    budget_table,
    error_figures,
    error_range,
    headline_facts,
    held_out_section,
    identifiability_blocks,
    learning_section,
    noise_tables,
    orientation_tables,
    parameter_figures,
    parameter_table,
    provenance_section,
    residuals_section,
    temperature_section,
    terms_section,
    tilts_section,
    uncalibrated_ranges,
    uncalibrated_rows,
)

HEADLINES: dict[Status, str] = {
    "good": "Calibrated, and the numbers can be trusted",
    "care": "Calibrated, with reservations: read the checks below before relying on the result",
    "bad": "Do not rely on this calibration yet",
    "unknown": "Calibrated; whether it can be trusted cannot be judged yet",
}
"""Headline of a calibration by its verdict."""


@dataclass(frozen=True, eq=False)
class CalibrationStudy:
    """A calibration on measured poses, as its folder has it.

    `results` is the document of results.json, `estimate` the block of estimates.yaml. `points` are those of the fit; they have errors of
    the rigid model where it is not the calibrated one. `arms` is the calibrated robot at them,
    `tilts` are the readings of inclinometers.
    """

    results: Mapping[str, Any]
    estimate: Estimate
    points: MeasuredPoints
    arms: ArmPoses
    loads: GravityLoads | None = None
    tilts: MeasuredTilts | None = None


def calibration_page(study: CalibrationStudy) -> Page:
    """The page before it becomes HTML."""
    results, points = study.results, study.points
    sections, considered = [_accuracy_section(study)], considered_terms(results)
    if results["held_out"] is not None:
        sections.append(held_out_section(results["held_out"]))
    kept = tuple(results["identifiability"]["selected"]["kept"])
    held = in_sockets(points)
    if considered:
        sections.append(terms_section(considered, results["term_selection_by"]))
    if results.get("learning_curve"):
        sections.append(learning_section(results["learning_curve"]))
    if results.get("temperature"):
        sections.append(temperature_section(results["temperature"], study.estimate, points))
    sections += [
        residuals_section(
            results["joints"],
            points.poses,
            points.calibrated,
            study.estimate.outliers,
            study.loads,
            study.arms if held else None,
        ),
        *(() if study.tilts is None else (tilts_section(results["joints"], study.tilts),)),
        Section(
            "geometry",
            "Parameters",
            "Parameters that the measurements do not determine keep their nominal values; the parameters that absorb them are named "
            "beside them.",
            (
                *identifiability_blocks(
                    IdentifiableParameters.stored(results["identifiability"]["selected"]), None
                ),
                *parameter_figures(study.estimate, kept),
                parameter_table(
                    study.estimate, kept, None, remark=CONDITIONAL if results["term_selection"] else ""
                ),
            ),
        ),
        provenance_section(results["command"], None, {}, study.estimate.provenance),
    ]
    stations = len(points.poses.stations)
    where = f" of {stations} stations or instruments" if stations > 1 else ""
    if held:
        where = f" with a ball in sockets, at {stations} place{'s' * (stations > 1)} of the fixture"
    return Page(
        title=f"{results['robot']}: calibration report",
        subtitle=f"Calibration on {len(points.poses)} {'poses' if held else 'measurements'}{where}"
        + f" · terms: {', '.join(term.replace('_', ' ') for term in results['terms'])}",
        verdict=calibration_verdict(study),
        sections=sections,
        document=results,
    )


def calibration_verdict(study: CalibrationStudy) -> Verdict:
    """Accuracy before and after calibration at the measured poses, and the verdict."""
    before, after = study.points.before, study.points.statistics(CALIBRATED)
    checks = calibration_checks(study.results, study.estimate, study.points)
    trust, words = Trust(checks), MeasuredWords.of(study.points.poses)
    ranges = uncalibrated_ranges(study.points)
    if RIGID in study.points.errors:
        ranges.append(error_range("rigid geometry", study.points.statistics(RIGID), "rigid"))
    ranges.append(error_range("calibrated", after, "elastic"))
    return Verdict(
        trust.status,
        HEADLINES[trust.status],
        f"{_was(before, words)}At the same {after.poses} {words.rows} the calibrated model has a P90 of {millimetres(after.p90)} mm and a "
        f"maximum of {millimetres(after.max)} mm{_better(before, after)}.{_outside(study.results)}",
        headline_facts(before, after, trust, f"{words.rows} of the fit"),
        tuple(ranges),
        f"Differences of the {after.poses} measurements from the robot",
        checks,
    )


def _was(before: ErrorStatistics | None, words: MeasuredWords) -> str:
    if before is None:
        return ""
    largest = f"{millimetres(before.max)} mm"
    return f"Before, {words.placed}, the robot's own error was up to {largest}. "


def _better(before: ErrorStatistics | None, after: ErrorStatistics) -> str:
    return "" if before is None else f": {ratio(before.p90, after.p90)} better"


def _outside(results: Mapping[str, Any]) -> str:
    held_out = results["held_out"]
    if held_out is None:
        return ""
    return (
        f" With each {held_out['by']} left out in turn, the mean error at those outside the fit is "
        f"{document_millimetres(held_out['mean_mm'])} mm."
    )


def _accuracy_section(study: CalibrationStudy) -> Section:
    points, seen = study.points, study.results["identifiability"]
    words, held = MeasuredWords.of(points.poses), in_sockets(points)
    ranks = {RIGID: str(seen["rank"]), CALIBRATED: str(seen["selected"]["rank"])}
    rows = [(*row, NOTHING) for row in uncalibrated_rows(points)]
    for model, label in _LABELS.items():
        if model in points.errors:
            statistics = points.statistics(model)
            rows.append((label, str(statistics.poses), *statistics_cells(statistics), ranks[model]))
    kinds = {
        name: ErrorStatistics.of_millimetres(own)
        for name, own in study.results["calibration"].get("by_kind", {}).items()
    }
    rows += [(f"of its {n}", str(own.poses), *statistics_cells(own), NOTHING) for n, own in kinds.items()]
    table = Table(
        "table-accuracy",
        "Errors at the measured poses",
        ("model", words.rows, "mean / mm", "P90 / mm", "max / mm", "determined parameters"),
        tuple(rows),
        note=words.note,
        strong=(len(rows) - 1 - len(kinds),),
    )
    remarks, before = study.results["remarks"], points.delivered
    return Section(
        "accuracy",
        "Before and after",
        (
            f"{words.distance}. These are the poses of the fit; errors outside it are in a section of their own"
            + ("." if study.results["held_out"] is not None else " after a run with --hold-out COLUMN.")
            if held
            else "Differences between what was measured and what is predicted; of points, their distances. These are the poses of the fit; "
            "measure others and run flexcal verify."
        ),
        (
            table,
            *orientation_tables(study.results.get("orientation")),
            *([Text((), "Remarks", sentences(remarks))] if remarks else []),
            budget_table(study.results["variances"], "ball in its socket" if held else "instrument"),
            *noise_tables(study.results["fit"].get("stated_noise", ())),
            arm_figure(study.arms, points.poses),
            *(() if before is None else error_figures(points.poses, before, points.calibrated)),
        ),
    )


_LABELS = {
    RIGID: "rigid geometry",
    CALIBRATED: "calibrated",
}
