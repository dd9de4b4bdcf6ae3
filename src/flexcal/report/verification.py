"""The report of a verification on measured poses (`flexcal verify`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration import ErrorStatistics, Verification
from flexcal.data import PoseSet
from flexcal.model import RobotModel
from flexcal.report.checks import FEW_POSES, check_claimed_uncertainty, check_flanks
from flexcal.report.figures.error_distribution import error_distribution
from flexcal.report.figures.predicted_quantiles import predicted_quantiles
from flexcal.report.figures.residual_order import residual_order
from flexcal.report.figures.verification_errors import ErrorSeries, verification_errors
from flexcal.report.first_screen import rung, three_facts
from flexcal.report.notation import millimetres, statistics_cells
from flexcal.report.page import Block, Check, FigureBlock, Page, Section, Status, Table, Verdict, worst
from flexcal.report.palette import ELASTIC, NOMINAL
from flexcal.report.render import write_page
from flexcal.report.sections.provenance import provenance_section

_TRUST: dict[Status, tuple[str, str]] = {
    "good": ("Yes", "Verified on fresh poses"),
    "care": ("With care", "Verified; read what is not sure below before relying on it"),
    "bad": ("No", "Less accurate than predicted"),
    "unknown": ("Unknown", "Measured; nothing could be checked"),
}


@dataclass(frozen=True, eq=False)
class VerificationStudy:
    """A calibrated robot on measured poses that its calibration never saw.

    `before` (N, 3) m are the errors of the uncalibrated, rigid robot at the same poses after a rigid registration, None where there are
    too few poses for one. `provenance` holds input files with their hashes, `results` the document of results.json.
    """

    model: RobotModel
    poses: PoseSet
    verification: Verification
    before: np.ndarray | None = None
    provenance: Mapping[str, str] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    results: Mapping[str, Any] = field(default_factory=dict)
    command: str = ""


def write_verification_report(path: str | Path, study: VerificationStudy) -> None:
    """Write the report of `study` to `path`, atomically; raises `InputError` where it cannot be written."""
    write_page(path, verification_page(study))


def verification_page(study: VerificationStudy) -> Page:
    """The page before it becomes HTML."""
    return Page(
        title=f"{study.model.name}: verification report",
        subtitle=f"Accuracy of the calibrated robot at {len(study.poses)} measured points that the fit never saw",
        verdict=_verdict(study),
        sections=(
            _errors_section(study),
            provenance_section(study.command, None, study.seconds, study.provenance),
        ),
        document=study.results,
    )


def _verdict(study: VerificationStudy) -> Verdict:
    after = study.verification.all
    before = None if study.before is None else ErrorStatistics.of(study.before)
    checks = [_check_enough(after.poses), _check_predicted(study)]
    if study.model.backlash_joints:
        checks.append(check_flanks(study.verification))
    status = worst(checks)
    answer, headline = _TRUST[status]
    rungs = [] if before is None else [rung("as delivered", before, "nominal")]
    return Verdict(
        status,
        headline,
        f"At nine of ten of {after.poses} fresh points the calibrated model is within {millimetres(after.p90)} mm of what the instrument "
        f"reads, and within {millimetres(after.max)} mm at all of them. The instrument's own noise is part of these numbers.",
        three_facts(before, after, checks, answer, "points"),
        (*rungs, rung("calibrated", after, "elastic")),
        f"Error of the robot at {after.poses} fresh points, against the instrument",
        tuple(checks),
    )


def _check_predicted(study: VerificationStudy) -> Check:
    return check_claimed_uncertainty(
        study.verification, study.poses.sigma, noise_given=study.poses.sigma_given
    )


def _check_enough(poses: int) -> Check:
    question = "Were enough fresh poses measured?"
    if poses >= FEW_POSES:
        return Check(
            question, f"{poses} points; the 90 % value rests on about {max(1, poses // 10)} of them.", "good"
        )
    return Check(
        question, f"{poses} points are few; with {FEW_POSES} or more the worst ones mean something.", "care"
    )


def _errors_section(study: VerificationStudy) -> Section:
    result = study.verification
    series = [ErrorSeries("calibrated", ELASTIC, result.errors)]
    rows = [("calibrated", str(result.all.poses), *statistics_cells(result.all))]
    if study.before is not None:
        series.insert(0, ErrorSeries("as delivered", NOMINAL, study.before))
        before = ErrorStatistics.of(study.before)
        rows.insert(0, ("as delivered, after registration", str(before.poses), *statistics_cells(before)))
    if result.ambiguous.any():
        certain = result.unambiguous
        rows.append(("… where the backlash flank is certain", str(certain.poses), *statistics_cells(certain)))
    blocks: list[Block] = [
        Table(
            "table-accuracy",
            "Distances",
            ("model", "points", "mean / mm", "90 % within / mm", "worst / mm"),
            tuple(rows),
        ),
        FigureBlock(
            "figure-errors",
            "Error at every point",
            verification_errors(study.poses, series, result, None),
            "Distance between measured and predicted point, on a logarithmic scale.",
            f"Errors of {result.all.poses} points, up to {millimetres(result.all.max)} mm.",
        ),
        FigureBlock(
            "figure-distribution",
            "What share of points is better than a given error",
            error_distribution(series, {}),
            "Read across at 90 %: nine of ten points have an error smaller than where the curve crosses.",
            f"Cumulative distribution; 90 % of points are within {millimetres(result.all.p90)} mm.",
        ),
    ]
    if study.poses.sigma_given:
        blocks.append(
            FigureBlock(
                "figure-predicted",
                "Predicted against observed errors",
                predicted_quantiles(result, study.poses.sigma),
                "The covariance of the parameters and the instrument's noise predict how large errors should be. Points on the dashed "
                "line: the prediction was right. Above it: the robot is worse than promised. Below: better.",
                "Sorted observed errors against predicted quantiles.",
            )
        )
    blocks.append(
        FigureBlock(
            "figure-order",
            "Errors in the order of measuring",
            residual_order(result.errors),
            "A drift points to warm-up or to an instrument that moved since the calibration.",
            "Error components in measuring order.",
        )
    )
    return Section("errors", "Errors at fresh poses", "", tuple(blocks))
