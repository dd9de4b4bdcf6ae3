"""The report of a calibration on measured poses (`flexcal calibrate`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration import Calibration, ErrorStatistics, TermSelection
from flexcal.model import RobotModel
from flexcal.report.checks import check_drift, check_left_out, check_outliers, check_rank, check_residual
from flexcal.report.first_screen import rung, three_facts
from flexcal.report.notation import NOTHING, millimetres, ratio, statistics_cells
from flexcal.report.page import Check, Page, Section, Table, Verdict, worst
from flexcal.report.render import write_page
from flexcal.report.sections.geometry import error_figure, pose_figure
from flexcal.report.sections.identifiability import identifiability_blocks
from flexcal.report.sections.parameters import parameter_table
from flexcal.report.sections.provenance import provenance_section
from flexcal.report.sections.residuals import residuals_section
from flexcal.report.sections.terms import terms_section
from flexcal.report.two_stage import TRUST


@dataclass(frozen=True, eq=False)
class CalibrationStudy:
    """A calibration on measured poses.

    `before` (N, 3) m are the errors of the uncalibrated, rigid robot at the poses of `selected`, after a rigid registration; `rigid` is the
    fit without further terms, `selected` the one that is kept; `selection` is None where the terms were given. `provenance` holds input
    files with their hashes, `results` the document of results.json.
    """

    nominal: RobotModel
    before: np.ndarray
    rigid: Calibration
    selected: Calibration
    selection: TermSelection | None = None
    provenance: Mapping[str, str] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    results: Mapping[str, Any] = field(default_factory=dict)
    command: str = ""


def write_calibration_report(path: str | Path, study: CalibrationStudy) -> None:
    """Write the report of `study` to `path`, atomically; raises `InputError` where it cannot be written."""
    write_page(path, calibration_page(study))


def calibration_page(study: CalibrationStudy) -> Page:
    """The page before it becomes HTML."""
    fit = study.selected
    sections = [_accuracy_section(study)]
    if study.selection is not None and study.selection.table:
        sections.append(terms_section(study.selection))
    sections += [
        residuals_section(fit),
        Section(
            "geometry",
            "What the poses determine",
            "Not every length and angle can be seen from the points that were measured. What cannot is held at its nominal value, named "
            "here with what stands in for it.",
            (
                *identifiability_blocks(fit.identifiability, None),
                parameter_table(fit.estimate, _names(fit), None),
            ),
        ),
        provenance_section(study.command, None, study.seconds, study.provenance),
    ]
    stations = len(fit.poses.stations)
    return Page(
        title=f"{study.nominal.name}: calibration report",
        subtitle=f"Calibration on {len(fit.poses)} measured points"
        + (f" from {stations} stations" if stations > 1 else "")
        + f" · terms: {', '.join(term.replace('_', ' ') for term in fit.terms)}",
        verdict=calibration_verdict(study),
        sections=sections,
        document=study.results,
    )


def calibration_verdict(study: CalibrationStudy) -> Verdict:
    """How accurate it was, how accurate it is at the measured poses, and whether that can be trusted."""
    before, rigid, after = ErrorStatistics.of(study.before), study.rigid.errors, study.selected.errors
    checks = calibration_checks(study)
    status = worst(checks)
    answer, headline = TRUST[status]
    rungs = [rung("as delivered", before, "nominal")]
    if study.rigid is not study.selected:
        rungs.append(rung("rigid geometry", rigid, "rigid"))
    rungs.append(rung("calibrated", after, "elastic"))
    return Verdict(
        status,
        headline,
        f"As delivered, and after the best placement of the instrument, points were up to {millimetres(before.max)} mm from where the "
        f"robot should have been. The calibrated model is within {millimetres(after.p90)} mm at nine of ten of the same {after.poses} "
        f"points and {millimetres(after.max)} mm at worst: {ratio(before.p90, after.p90)} better.",
        three_facts(before, after, checks, answer, "points"),
        tuple(rungs),
        f"Error of the robot at the {after.poses} measured points",
        checks,
    )


def calibration_checks(study: CalibrationStudy) -> tuple[Check, ...]:
    """The checks behind the verdict."""
    fit, found = study.selected, study.selected.identifiability
    table = study.selection.table if study.selection is not None else ()
    left_out = next(((order, place) for terms, order, place in table if terms == fit.terms), None)
    return (
        check_left_out(fit.errors.mean, left_out),
        check_residual(
            "Does noise explain what the fit leaves?", fit.estimate, sigma_given=fit.poses.sigma_given
        ),
        check_rank(len(found.names), found.rank, found.gap),
        check_drift(fit),
        check_outliers(fit),
    )


def _accuracy_section(study: CalibrationStudy) -> Section:
    rows = [("as delivered, after registration", *_row(ErrorStatistics.of(study.before)), NOTHING)]
    if study.rigid is not study.selected:
        rows.append(("rigid geometry", *_row(study.rigid.errors), str(study.rigid.identifiability.rank)))
    rows.append(("calibrated", *_row(study.selected.errors), str(study.selected.identifiability.rank)))
    table = Table(
        "table-accuracy",
        "Errors at the measured poses",
        ("model", "points", "mean / mm", "90 % within / mm", "worst / mm", "determined parameters"),
        tuple(rows),
        strong=(len(rows) - 1,),
    )
    return Section(
        "accuracy",
        "Before and after",
        "Distances between measured and predicted points. These are the poses of the fit; poses that it never saw tell more: measure some "
        "and run flexcal verify.",
        (table, error_figure(study.selected, study.before), pose_figure(study.selected, study.before)),
    )


def _row(statistics: ErrorStatistics) -> tuple[str, ...]:
    return (str(statistics.poses), *statistics_cells(statistics))


def _names(fit: Calibration) -> tuple[str, ...]:
    kept = set(fit.identifiability.kept_names)
    return tuple(name for name in fit.estimate.parameters.names if name in kept)
