"""The page of an accuracy map (`flexcal map`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.accuracy import PredictedAccuracy
from flexcal.calibration.verification import ErrorScale, PredictionErrors
from flexcal.model.robot import RobotModel
from flexcal.report.checks import Trust, prediction_checks
from flexcal.report.figures import SHOWN, accuracy_space, accuracy_views, predicted_quantiles, variance_shares
from flexcal.report.layout import (
    Block,
    Fact,
    FigureBlock,
    Page,
    Section,
    Table,
    Text,
    Verdict,
    document_millimetres,
    scaled,
    significant,
)
from flexcal.report.sections import provenance_section, uncalibrated_table


@dataclass(frozen=True, eq=False)
class MapStudy:
    """A map, its `box` (2, 3) m where there is one, `results` as the verb prints them; what a verification says, and that verification."""

    model: RobotModel
    map: PredictedAccuracy
    box: np.ndarray | None
    results: Mapping[str, Any]
    scale: ErrorScale | None = None
    verification: PredictionErrors | None = None


def map_page(study: MapStudy) -> Page:
    """The page before it becomes HTML."""
    results, verified = study.results, study.results["verification"]
    fitted = [] if verified is None else verified["fitted"]
    p95, mean = results["predicted"]["p95"], results["predicted"]["mean"]
    trust = Trust(prediction_checks(study.scale, fitted, results.get("refused", "")))
    leading = max(results["sources"], key=results["sources"].__getitem__)
    verdict = Verdict(
        trust.status,
        f"Predicted accuracy: {document_millimetres(p95['p90_mm'])} mm",
        f"The 95 % bound of the error of the point '{results['target']}' has a P90 of {document_millimetres(p95['p90_mm'])} mm over "
        f"{results['poses']} poses, {_where(study)}, and a maximum of "
        f"{document_millimetres(p95['worst_mm'])} mm.",
        (
            Fact("What is the mean error?", document_millimetres(mean["median_mm"]), "mm", "Mean error, at the median pose."),
            Fact("What is the largest error?", document_millimetres(p95["worst_mm"]), "mm", "95 % bound at the worst pose."),
            Fact("What contributes most?", _percent(results["sources"][leading]), "%", f"of the variance: {leading}."),
        ),
        (),
        "",
        trust.checks,
    )  # fmt: skip
    sections = [_numbers(study), _space(study), _sources(study)]
    if study.verification is not None:
        sections.append(_observed(study))
    sections.append(provenance_section(results["command"], None, {}, results["provenance"]))
    return Page(
        title=f"{study.model.name}: accuracy map",
        subtitle=f"Predicted error of the tool with {significant(results['payload_kg'], 3)} kg of payload",
        verdict=verdict,
        sections=sections,
        document=results,
    )


def _where(study: MapStudy) -> str:
    if study.box is not None:
        low, high = study.box
        ranges = ", ".join(f"{n} {a:g} to {b:g}" for n, a, b in zip("xyz", low, high, strict=True))
        return f"random, with the point in the working volume ({ranges} m, base frame)"
    return "given, or random over the joint ranges"


_UP_ONLY = (
    "Where observed errors are significantly larger than predicted, all predictions are multiplied by the ratio; where they are smaller, "
    "predictions are not reduced, because errors at other poses may be larger."
)


def _applied(study: MapStudy) -> str:
    """Factor applied to the predictions."""
    verified = study.results["verification"]
    if verified is None or verified["applied"] == 1:
        return ""
    return f"Multiplied by {verified['applied']:.2f}, the observed over the predicted size of the errors at the verification poses."


def _numbers(study: MapStudy) -> Section:
    results = study.results
    rows = tuple(
        (
            label,
            *(
                document_millimetres(results["predicted"][key][column])
                for column in ("median_mm", "p90_mm", "worst_mm")
            ),
        )
        for label, key in (("uncalibrated", "uncalibrated"), ("mean error", "mean"), ("95 % bound", "p95"))
        if results["predicted"][key] is not None
    )
    places = []
    for item in results["worst"]:
        leading = max(item["sources"], key=item["sources"].__getitem__)
        place = ", ".join(f"{value:.3f}" for value in item["position_m"])
        places.append(
            (
                place,
                document_millimetres(item["mean_mm"]),
                document_millimetres(item["p95_mm"]),
                leading,
                _joints(study.model, item["q"]),
            )
        )
    blocks: list[Block] = [
        Table(
            "table-errors",
            "Predicted error / mm",
            ("", "median pose", "P90 over poses", "worst pose"),
            rows,
            _applied(study),
        ),
        Table(
            "table-worst",
            "Largest errors",
            ("x, y, z / m", "mean / mm", "95 % / mm", "main source", "joint positions"),
            tuple(places),
            text_columns=(3, 4),
            note="In the robot's base frame; only places apart from each other are listed.",
        ),
        Text(
            (
                "The error is the distance between the position predicted by the calibrated model and that measured by an instrument at "
                f"the station '{results['station']}' without the instrument's noise. It is propagated from the covariance of "
                "all estimates; effects that are not modelled, such as wear or warm-up, are not included.",
                "Of the uncalibrated robot, best-fit registered over these poses, it is the distance to the calibrated model.",
            )
        ),
    ]
    return Section("numbers", "Predicted errors", "", tuple(blocks))


def _space(study: MapStudy) -> Section:
    accuracy, poses = study.map, study.results["poses"]
    drawn = min(len(accuracy.q), SHOWN)
    behind = "all poses" if len(accuracy.q) == poses else f"the first {len(accuracy.q)} of {poses} poses"
    blocks: tuple[Block, ...] = (
        FigureBlock(
            "figure-views",
            "Three views of the volume",
            accuracy_views(accuracy),
            f"Colour: 95 % bound of the error, averaged over {behind} behind a cell.",
            "Predicted error in three views of the volume.",
        ),
        FigureBlock(
            "figure-space",
            "In three dimensions",
            accuracy_space(accuracy),
            f"{drawn} of {poses} poses, each in its own orientation of the tool. Drag to turn.",
            f"Predicted error of {drawn} poses in space.",
        ),
    )
    return Section("space", "Errors over the workspace", "", blocks)


def _sources(study: MapStudy) -> Section:
    results = study.results
    block = FigureBlock(
        "figure-sources",
        "Sources of the error",
        variance_shares(results["sources"], results["worst"][0]["sources"]),
        "Relative reduction of the error variance if all parameters of a kind were known exactly. Kinds are "
        "correlated, so the bars need not add up to 100 %. To reduce the longest bar, measure more or better chosen poses: "
        "flexcal design poses.",
        "Shares of the variance by kind of parameter.",
    )
    return Section("sources", "Error sources", "", (block,))


def _observed(study: MapStudy) -> Section:
    assert study.verification is not None and study.scale is not None
    verification = study.verification
    scale = study.scale
    rows = (
        ("observed over predicted size", f"{scale.ratio:.2f}"),
        ("95 % interval", f"{scale.ratio_low:.2f} to {scale.ratio_high:.2f}"),
        ("effective degrees of freedom", f"{scale.freedom:.0f}"),
        ("poses within the bound for 95 %", f"{100 * scale.inside:.0f} %"),
        ("poses within the bound for 50 %", f"{100 * float((scale.probability <= 0.5).mean()):.0f} %"),
    )
    blocks: tuple[Block, ...] = (
        Table("table-scale", "Observed against predicted errors", ("", ""), rows),
        Text((_UP_ONLY,)),
        uncalibrated_table(study.results["before"]),
        FigureBlock(
            "figure-predicted",
            "Observed against predicted errors",
            predicted_quantiles(verification),
            "Sorted errors at the verification poses against the quantiles that the covariance of the parameters and the instrument's "
            "noise predict. Points on the dashed line: the prediction was right. Above it: errors are larger than predicted.",
            "Sorted observed errors against predicted quantiles.",
        ),
    )
    return Section("observed", "Verification", "", blocks)


def _joints(model: RobotModel, q: np.ndarray) -> str:
    texts = []
    for joint, value in zip(model.motor_joints, q, strict=True):
        if joint.kind == "revolute":
            texts.append(f"{np.degrees(value):.0f}°")
        else:
            factor, unit = scaled("m")
            texts.append(f"{factor * value:.0f} {unit}")
    return ", ".join(texts)


def _percent(share: float) -> str:
    return f"{100 * share:.0f}"
