"""The report of a verification on measured poses (`flexcal verify`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.verification import ArmPoses, MeasuredPoints, PredictionErrors
from flexcal.report.checks import Trust, verification_checks
from flexcal.report.figures import ErrorSeries, error_distribution, predicted_quantiles, verification_errors
from flexcal.report.layout import (
    ELASTIC,
    NOMINAL,
    Block,
    FigureBlock,
    Page,
    Section,
    Status,
    Table,
    Text,
    Verdict,
    document_millimetres,
    millimetres,
    sentences,
    statistics_cells,
)
from flexcal.report.sections import (
    MeasuredWords,
    arm_figure,
    error_range,
    headline_facts,
    orientation_tables,
    provenance_section,
    residual_blocks,
    uncalibrated_ranges,
    uncalibrated_rows,
)

_HEADLINES: dict[Status, str] = {
    "good": "Verified on fresh poses",
    "care": "Verified, with reservations: read the checks below before relying on the result",
    "bad": "Less accurate than predicted",
    "unknown": "Measured; whether the calibration can be trusted cannot be judged",
}
_MOST = 24
"""Largest number of distances between sockets in a table."""


@dataclass(frozen=True, eq=False)
class VerificationStudy:
    """Verification of a calibrated robot on measured poses outside the fit, as the folder has it.

    `results` is the document of results.json; `arms` is the calibrated robot at the `points`, which have no nominal errors where there
    are too few for a registration.
    """

    results: Mapping[str, Any]
    points: MeasuredPoints
    arms: ArmPoses

    @property
    def verification(self) -> PredictionErrors:
        """Prediction, errors and their predicted standard deviations."""
        return self.points.verification


def verification_page(study: VerificationStudy) -> Page:
    """The page before it becomes HTML."""
    results, words = study.results, MeasuredWords.of(study.points.poses)
    return Page(
        title=f"{results['robot']}: verification report",
        subtitle=f"Accuracy of the calibrated robot at {len(study.points.poses)} measured {words.rows}"
        + ("" if results["fitted"] else " outside the fit"),
        verdict=_verdict(study),
        sections=(
            _errors_section(study),
            _residuals_section(study),
            provenance_section(results["command"], None, {}, results["provenance"]),
        ),
        document=results,
    )


def _verdict(study: VerificationStudy) -> Verdict:
    result, fitted = study.verification, study.results["fitted"]
    after = result.all
    before = study.points.before
    checks = verification_checks(study.results, study.points)
    trust = Trust(checks)
    words = MeasuredWords.of(study.points.poses)
    noun = words.rows if fitted else f"fresh {words.rows}"
    return Verdict(
        trust.status,
        _HEADLINES[trust.status],
        f"At {after.poses} {noun} errors of the calibrated model have a P90 of {millimetres(after.p90)} mm and a maximum of "
        f"{millimetres(after.max)} mm. {words.noise[0].upper()}{words.noise[1:]} is included.{_refitted(study.results)}",
        headline_facts(before, after, trust, words.rows),
        (*uncalibrated_ranges(study.points), error_range("calibrated", after, "elastic")),
        f"Error of the robot at {after.poses} {noun}, against {words.against}",
        checks,
    )


def _refitted(results: Mapping[str, Any]) -> str:
    """Sentence on the quantities fitted to the verification's own poses."""
    refit = results.get("refit")
    if not refit:
        return ""
    words = " and ".join(
        {"station": "place of the instrument", "point": "measured point"}[w] for w in refit["what"]
    )
    return f" Fitted to these points: {words}; errors are leave-one-out errors, so this tests the geometry alone."


def _errors_section(study: VerificationStudy) -> Section:
    result = study.verification
    series = [ErrorSeries("calibrated", ELASTIC, result.errors)]
    refit = study.results.get("refit")
    label = f"calibrated, {' and '.join(refit['what'])} refitted (leave-one-out)" if refit else "calibrated"
    rows = uncalibrated_rows(study.points)
    if refit and (block := study.results["verification"].get("as_calibrated")):
        stands = ErrorStatistics.of_millimetres(block)
        rows.append(("calibrated, nothing refitted", str(stands.poses), *statistics_cells(stands)))
    rows.append((label, str(result.all.poses), *statistics_cells(result.all)))
    if study.points.delivered is not None:
        series.insert(0, ErrorSeries("before, the robot's own", NOMINAL, study.points.delivered))
    if result.ambiguous.any():
        certain = result.unambiguous
        rows.append(("… where the backlash flank is certain", str(certain.poses), *statistics_cells(certain)))
    poses, remarks = study.points.poses, study.results["remarks"]
    words = MeasuredWords.of(poses)
    blocks: list[Block] = [
        Table(
            "table-accuracy",
            "Distances",
            ("model", words.rows, "mean / mm", "P90 / mm", "max / mm"),
            tuple(rows),
            note=words.note,
        ),
        *orientation_tables(study.results.get("orientation")),
        *_distance_table(study.results.get("distances", ())),
        *([Text((), "Remarks", sentences(remarks))] if remarks else []),
        arm_figure(study.arms, poses),
        FigureBlock(
            "figure-errors",
            f"Error at every {words.rows.removesuffix('s')}",
            verification_errors(poses, series, result, None),
            f"{words.distance}, on a logarithmic scale.",
            f"Errors of {result.all.poses} {words.rows}, up to {millimetres(result.all.max)} mm.",
        ),
        FigureBlock(
            "figure-distribution",
            "Cumulative distribution of the errors",
            error_distribution(series, {}),
            "P90 is where a curve crosses 90 %.",
            f"Cumulative distribution; P90 is {millimetres(result.all.p90)} mm.",
        ),
    ]
    if study.results["prediction"] is not None:
        blocks.append(
            FigureBlock(
                "figure-predicted",
                "Observed against predicted errors",
                predicted_quantiles(result),
                f"The covariance of the parameters and {words.noise} predict how large errors should be. Points on the dashed "
                "line: the prediction was right. Above it: errors are larger than predicted. Below: smaller.",
                "Sorted observed errors against predicted quantiles.",
            )
        )
    return Section(
        "errors",
        f"Errors at the measured {words.rows}"
        if study.results["fitted"]
        else f"Errors at fresh {words.rows}",
        "",
        tuple(blocks),
    )


def _distance_table(distances: Sequence[Mapping[str, Any]]) -> tuple[Table, ...]:
    """Errors of the known distances between sockets; `distances` are those of results.json."""
    if not distances:
        return ()
    rows = tuple(
        (
            f"{item['place']}: {' to '.join(item['sockets'])}",
            *(document_millimetres(item[key]) for key in ("declared_mm", "before_mm", "error_mm", "std_mm")),
        )
        for item in distances[:_MOST]
    )
    more = len(distances) - len(rows)
    return (
        Table(
            "table-distances",
            "Distances between sockets",
            ("sockets", "declared / mm", "error before / mm", "error calibrated / mm", "predicted 1σ / mm"),
            rows,
            note="Found minus declared, each socket being the mean of the predicted positions of the ball in it."
            + (f" And {more} more, listed in results.json." if more > 0 else ""),
        ),
    )


def _residuals_section(study: VerificationStudy) -> Section:
    return Section(
        "residuals",
        "Errors by joint, time and position",
        "Errors that depend on a joint, on time or on the position in the working volume indicate a term that the model lacks.",
        residual_blocks(
            study.results["joints"],
            study.points.poses,
            study.points.calibrated,
            study.arms if study.points.poses.in_socket.any() else None,
        ),
    )
