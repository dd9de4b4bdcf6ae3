"""The report of repeated visits (`flexcal repeatability`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.accuracy import CYCLES, VISITS_PER_SET, PoseRepeatability
from flexcal.data.poses import PoseSet
from flexcal.report.figures import pose_courses, residual_trend
from flexcal.report.layout import (
    Check,
    Fact,
    FigureBlock,
    Page,
    Section,
    Table,
    Text,
    Verdict,
    document_millimetres,
    worst,
)
from flexcal.report.sections import provenance_section

KINDS = {"nominal": "AP before (the robot's own)", "calibrated": "AP calibrated"}


_DRAWN, _LISTED = 20_000, 1000
"""Largest number of visits in a figure and of poses in a table."""


@dataclass(frozen=True, eq=False)
class RepeatabilityStudy:
    """The `visited` among `poses` of the robot called `name`, and `results` as the verb prints them."""

    name: str
    poses: PoseSet
    visited: Sequence[PoseRepeatability]
    results: Mapping[str, Any]


def repeatability_page(study: RepeatabilityStudy) -> Page:
    """The page before it becomes HTML."""
    results = study.results
    checks = _checks(study)
    rp = results["rp_mm"]
    facts = [
        Fact(
            "What is its repeatability?",
            document_millimetres(rp["max"]),
            "mm",
            "RP at the worst pose (ISO 9283).",
        )
    ]
    for kind, label in KINDS.items():
        if f"ap_{kind}_mm" in results:
            block = results[f"ap_{kind}_mm"]
            facts.append(
                Fact(
                    f"{label}?",
                    document_millimetres(block["mean"]),
                    "mm",
                    f"Mean over the poses; worst {document_millimetres(block['max'])} mm.",
                )
            )
    verdict = Verdict(
        worst(checks),
        f"Repeatability RP: {document_millimetres(rp['max'])} mm",
        f"{results['poses']} poses were visited {results['visits']['total']} times in all; "
        f"RP is {document_millimetres(rp['mean'])} mm on average.",
        tuple(facts),
        (),
        "",
        checks,
    )
    return Page(
        title=f"{study.name}: repeatability and pose accuracy",
        subtitle="After ISO 9283:1998, clauses 7.2.1 to 7.2.3"
        + ("" if results["drift"] is None else ", and drift of pose characteristics"),
        verdict=verdict,
        sections=[
            _poses_section(study),
            *([] if results["drift"] is None else [_drift_section(results["drift"])]),
            _order_section(study),
            provenance_section(results["command"], None, {}, results["provenance"]),
        ],
        document=results,
    )


def repeatability_table(results: Mapping[str, Any]) -> Table:
    """One row a pose."""
    kinds = [kind for kind in KINDS if f"ap_{kind}_mm" in results]
    columns = ("pose", "visits", *(f"{KINDS[kind]} / mm" for kind in kinds), "RP / mm", "vAP / mm")
    rows = []
    most = sorted(results["each"], key=lambda item: -item["rp_mm"])[:_LISTED]
    listed = (
        sorted(most, key=lambda item: item["pose"]) if len(results["each"]) > _LISTED else results["each"]
    )
    for item in listed:
        accuracy = [document_millimetres(item[f"ap_{kind}_mm"]) for kind in kinds]
        rows.append(
            (
                str(item["pose"]),
                str(item["visits"]),
                *accuracy,
                document_millimetres(item["rp_mm"]),
                document_millimetres(item["vap_mm"]),
            )
        )
    caption = (
        "Pose by pose"
        if listed is results["each"]
        else f"The {_LISTED} poses with the largest RP, of {results['poses']}"
    )
    return Table("table-poses", caption, columns, tuple(rows))


def _checks(study: RepeatabilityStudy) -> tuple[Check, ...]:
    fewest = study.results["visits"]["fewest"]
    enough = fewest >= CYCLES
    answer = (
        f"{fewest} or more."
        if enough
        else f"{fewest} at the pose with the fewest; ISO 9283 asks for {CYCLES}."
    )
    checks = [Check("Was every pose visited often enough?", answer, "good" if enough else "care")]
    noise = study.results["instrument_rp_mm"]
    question = "Is the scatter that of the robot rather than of the instrument?"
    if noise is None:
        checks.append(Check(question, "The files state no sigma, so this cannot be judged.", "unknown"))
    else:
        seen = study.results["rp_mm"]["mean"]
        answer = f"The instrument's noise alone corresponds to an RP of {document_millimetres(noise)} mm; "
        answer += f"the mean measured RP is {document_millimetres(seen)} mm."
        checks.append(Check(question, answer, "good" if seen > 1.5 * noise else "care"))
    if (drift := study.results["drift"]) is not None:
        moved = [item for item in drift["each"] if item["certain"]]
        farthest = max(drift["each"], key=lambda item: item["way_mm"][-1])
        answer = (
            f"The barycentre moved significantly at {len(moved)} of {len(drift['each'])} poses, at most "
            f"by {document_millimetres(farthest['way_mm'][-1])} mm at pose {farthest['pose']}."
            if moved
            else "No drift detected."
        )
        checks.append(Check("Did it drift during the measurement?", answer, "care" if moved else "good"))
    return tuple(checks)


def _drift_section(drift: Mapping[str, Any]) -> Section:
    kinds = [kind for kind in KINDS if f"dap_{kind}_mm" in drift]
    columns = (
        "pose",
        "sets",
        *(f"d{KINDS[kind]} / mm" for kind in kinds),
        "dRP / mm",
        "displacement / mm",
        "significant",
    )
    rows = tuple(
        (
            str(item["pose"]),
            str(len(item["t_s"])),
            *(document_millimetres(item[f"dap_{kind}_mm"]) for kind in kinds),
            document_millimetres(item["drp_mm"]),
            document_millimetres(item["way_mm"][-1]),
            "yes" if item["certain"] else "no",
        )
        for item in drift["each"]
    )
    sentences = [
        f"The visits to each pose are divided into consecutive sets of {VISITS_PER_SET} or more. dAP and dRP are the changes of AP and RP "
        "from the first set to the last. AP may stay constant while the barycentre moves about the command: the displacement is "
        "the distance "
        "between the barycentres of the first and the last set, tested by Hotelling's two-sample test (significant: p < 0.0027).",
    ]
    if len(drift["each"]) > 1:
        sentences.append(
            f"Drift: the displacement common to all poses is {document_millimetres(drift['together_mm'])} mm, as of a moving base or "
            f"instrument; the remainder is {document_millimetres(drift['apart_mm'])} mm (root mean square), as of thermal expansion."
        )
    blocks = (
        Table("table-drift", "Drift from the first visits to the last", columns, rows),
        FigureBlock(
            "figure-drift",
            "Drift of every pose",
            pose_courses(drift["each"]),
            "One mark a set, at the mean time of its visits. The noise of the instrument is part of it.",
            "Displacement of the barycentre and RP of every pose against time.",
        ),
        Text(tuple(sentences)),
    )
    return Section("drift", "What drifted meanwhile", "", blocks)


def _poses_section(study: RepeatabilityStudy) -> Section:
    text = Text(
        (
            "AP is the distance between the barycentre of all visits and the commanded point; RP is the mean distance of the visits from "
            "their barycentre plus three of its standard deviations; vAP is the largest distance between barycentres of visits that came "
            "from different poses. The noise of the instrument is part of all of them.",
            "As delivered, the commanded point is that of the nominal robot, best-fit registered; "
            "calibrated, it is that of the calibrated model.",
        )
    )
    return Section("poses", "Accuracy and repeatability", "", (repeatability_table(study.results), text))


def _order_section(study: RepeatabilityStudy) -> Section:
    rows = np.concatenate([pose.rows for pose in study.visited])
    deviations = np.concatenate([pose.deviations for pose in study.visited])
    stride = -(-len(rows) // _DRAWN)
    drawn = np.argsort(rows)[::stride]
    thinned = f" Of {len(rows)} visits one in {stride} is drawn." if stride > 1 else ""
    block = FigureBlock(
        "figure-order",
        "Deviations from the barycentre, in the order of measuring",
        residual_trend(
            rows[drawn], deviations[drawn], "row of the file, in order", "measured minus barycentre"
        ),
        f"A trend indicates drift: a robot that warms up or an instrument that settles.{thinned}",
        "Components of the deviations in measuring order.",
    )
    return Section("order", "In the order of measuring", "", (block,))
