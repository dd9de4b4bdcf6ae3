"""The report of a folder, from what a verb left in it: its numbers, and the figures that the stored data carry (`flexcal report`)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.calibration import ErrorStatistics
from flexcal.estimates_file import Block
from flexcal.estimation import Estimate
from flexcal.frequency import FrequencyResponse
from flexcal.report.checks import (
    check_fresh_poses,
    check_left_out,
    check_rank,
    check_residual,
    check_springs,
    check_truth,
)
from flexcal.report.figures.error_distribution import error_distribution
from flexcal.report.figures.verification_errors import ErrorSeries
from flexcal.report.first_screen import rung, three_facts
from flexcal.report.measured_points import NOMINAL, ArmPoses, MeasuredPoints
from flexcal.report.notation import millimetres, statistics_cells
from flexcal.report.page import (
    Check,
    Fact,
    FigureBlock,
    Page,
    Section,
    Table,
    Text,
    Verdict,
    tally,
    worst,
)
from flexcal.report.palette import ELASTIC, RIGID
from flexcal.report.render import write_page
from flexcal.report.sections.geometry import arm_figure, error_figure
from flexcal.report.sections.identifiability import dropped_table
from flexcal.report.sections.parameters import parameter_table
from flexcal.report.sections.provenance import provenance_section
from flexcal.report.sections.residuals import residuals_section
from flexcal.report.sections.springs import spring_table, unseen_springs
from flexcal.report.sections.stiffness import response_block
from flexcal.report.two_stage import TRUST
from flexcal.units import MILLIMETRE

_ROWS: tuple[tuple[str, str, Literal["nominal", "rigid", "elastic", "floor"]], ...] = (
    ("nominal", "as delivered", "nominal"),
    ("rigid", "rigid geometry", "rigid"),
    ("selected", "calibrated", "elastic"),
    ("elastic", "calibrated", "elastic"),
    ("measured", "calibrated, against the instrument", "elastic"),
    ("floor", "every parameter known", "floor"),
)
"""Blocks of errors in results.json, in the order of the report: key, label, kind of rung."""


@dataclass(frozen=True, eq=False)
class StoredStudy:
    """What lies in the folder `name`.

    `results` is the document of results.json, `estimates` the blocks of estimates.yaml, `responses` the frequency responses by pose,
    `errors` (N, 3) m those of verification.csv by model (elastic, rigid); `points` and `arms` those that the geometry was fitted to.
    """

    name: str
    results: Mapping[str, Any]
    estimates: Mapping[Block, Estimate] = field(default_factory=dict)
    responses: Sequence[FrequencyResponse] = ()
    errors: Mapping[str, np.ndarray] = field(default_factory=dict)
    points: MeasuredPoints | None = None
    arms: ArmPoses | None = None

    def statistics(self, block: str) -> dict[str, ErrorStatistics]:
        """Errors of `verification` or `calibration` by model, in the order of the report."""
        found = self.results.get(block, {})
        found = {"selected": found} if "mean_mm" in found else found
        return {key: _statistics(found[key]) for key, _, _ in _ROWS if found.get(key)}

    @property
    def fresh(self) -> dict[str, ErrorStatistics]:
        """Errors at poses that no fit saw."""
        return self.statistics("verification")

    @property
    def truth(self) -> dict[str, float]:
        """Stiffness and damping as they really are, where known."""
        return {
            f"{joint}.{spring}.{kind}": quantity["truth"]
            for kind in ("stiffness", "damping")
            for joint, springs in self.results.get("stage1", {}).get(kind, {}).items()
            for spring, quantity in springs.items()
            if quantity["truth"] is not None
        }

    def springs(self, kind: str) -> tuple[str, ...]:
        """Names of all stored stiffnesses or dampings of stage 1."""
        stiffness = self.estimates.get("stiffness")
        names = stiffness.parameters.names if stiffness else ()
        return tuple(name for name in names if name.endswith(f".{kind}"))


def write_stored_report(path: str | Path, study: StoredStudy) -> None:
    """Write the report of `study` to `path`, atomically; raises `InputError` where it cannot be written."""
    write_page(path, stored_page(study))


def stored_page(study: StoredStudy) -> Page:
    """The page before it becomes HTML."""
    sections = [
        section
        for section in (_errors(study), _stiffness(study), *_points(study), _geometry(study))
        if section.blocks
    ]
    origin = {
        f"{block}: {key}": value
        for block, estimate in study.estimates.items()
        for key, value in estimate.provenance.items()
    }
    results = study.results
    sections.append(
        provenance_section(
            results.get("command", ""), results.get("seed"), results.get("seconds", {}), origin
        )
    )
    return Page(
        title=f"{study.name}: report",
        subtitle="Made from the numbers stored in this folder; figures that need the fit itself come from the command that made it"
        if "verification" in results
        else "Stiffness and damping of drives and bearings, from frequency responses",
        verdict=_verdict(study),
        sections=sections,
        document=results,
    )


def _verdict(study: StoredStudy) -> Verdict:
    fresh, fitted = study.fresh, study.statistics("calibration")
    known = fresh or fitted
    noun = "fresh poses" if fresh else "measured poses of the fit"
    after = next((known[key] for key in ("elastic", "selected", "measured") if key in known), None)
    checks = _checks(study)
    status = worst(checks) if checks else "unknown"
    answer, headline = TRUST[status]
    if after is None:
        facts = (Fact("Can I trust it?", answer, "", f"{tally(checks)}; each is explained below.", status),)
        sentence = "Stiffness and damping were identified; how accurate the tool is, positions have to tell."
    else:
        facts = three_facts(known.get("nominal"), after, checks, answer, "poses")
        sentence = (
            f"At nine of ten of {after.poses} {noun} the calibrated model is within {millimetres(after.p90)} mm, and within "
            f"{millimetres(after.max)} mm at all of them."
        )
    rungs = tuple(rung(label, known[key], kind) for key, label, kind in _ROWS if key in known)
    return Verdict(status, headline, sentence, facts, rungs, f"Error of the tool at the {noun}", checks)


def _checks(study: StoredStudy) -> tuple[Check, ...]:
    fresh, fitted = study.fresh, study.statistics("calibration")
    checks = []
    if "elastic" in fresh and "selected" in fitted:
        checks.append(check_fresh_poses(fitted["selected"], fresh["elastic"]))
    elif not fresh and "selected" in fitted:
        checks.append(check_left_out(fitted["selected"].mean, _left_out(study.results)))
    sigma_given = study.results.get("fit", {}).get("sigma_given", True)
    for block, estimate in study.estimates.items():
        question = f"Does noise explain what the fit of the {block} leaves?"
        given = sigma_given if block == "calibration" else True
        checks.append(check_residual(question, estimate, sigma_given=given))
    if "stiffness" in study.estimates:
        stiffness = study.estimates["stiffness"]
        checks.append(check_springs(stiffness, study.springs("stiffness"), study.springs("damping")))
        intervals = [(stiffness.interval(name), value) for name, value in study.truth.items()]
        inside = [i[0] <= value <= i[1] for i, value in intervals if i is not None]
        if inside:
            checks.append(check_truth(sum(inside), len(inside)))
    seen = study.results.get("identifiability")
    if seen:
        gap = seen["gap_decades"]
        checks.append(check_rank(seen["parameters"], seen["rank"], math.inf if gap is None else gap))
    return tuple(checks)


def _errors(study: StoredStudy) -> Section:
    rows = []
    for block, where in (("calibration", "poses of the fit"), ("verification", "fresh poses")):
        found = study.statistics(block)
        rows += [
            (label, where, str(found[key].poses), *statistics_cells(found[key]))
            for key, label, _ in _ROWS
            if key in found
        ]
    blocks: list[Table | FigureBlock | Text] = []
    if rows:
        columns = ("model", "at", "poses", "mean / mm", "90 % within / mm", "worst / mm")
        blocks.append(
            Table("table-accuracy", "Errors of every model", columns, tuple(rows), text_columns=(1,))
        )
    if study.results.get("remarks"):
        blocks.append(Text((), "Remarks", tuple(study.results["remarks"])))
    if study.errors:
        colours = {"elastic": ELASTIC, "rigid": RIGID}
        series = [ErrorSeries(f"{kind} calibration", colours[kind], e) for kind, e in study.errors.items()]
        blocks.append(
            FigureBlock(
                "figure-distribution",
                "What share of fresh poses is better than a given error",
                error_distribution(series, {}),
                "Read across at 90 %: nine of ten poses have an error smaller than where the curve crosses. Farther left is better.",
                "Cumulative distributions of the errors in verification.csv; their numbers are in the table above.",
            )
        )
    return Section("errors", "Accuracy", "", tuple(blocks))


def _stiffness(study: StoredStudy) -> Section:
    blocks: list[Table | FigureBlock | Text] = []
    estimate, truth = study.estimates.get("stiffness"), study.truth or None
    if estimate is not None:
        for kind in ("stiffness", "damping"):
            blocks.append(spring_table(estimate, study.springs(kind), kind, truth, {}, ""))
        unseen = unseen_springs(estimate, study.springs("stiffness") + study.springs("damping"))
        if unseen:
            blocks.append(Text((), "Not determined by these data", unseen))
    if study.responses:
        blocks.append(response_block(study.responses[0], f"Pose {study.responses[0].pose + 1}"))
    return Section("stage1", "Springs and dampers", "", tuple(blocks))


def _points(study: StoredStudy) -> tuple[Section, ...]:
    points, arms = study.points, study.arms
    if points is None or arms is None:
        return ()
    blocks = (
        arm_figure(arms, len(points.poses)),
        error_figure(points.poses, points.errors[NOMINAL], points.calibrated),
    )
    return (
        Section("points", "The measured points of the fit", "", blocks),
        residuals_section(study.results["joints"], points.poses, points.calibrated, ()),
    )


def _geometry(study: StoredStudy) -> Section:
    estimate = study.estimates.get("calibration")
    if estimate is None:
        return Section("geometry", "Geometry", "", ())
    names = tuple(name for name in estimate.parameters.names if estimate.interval(name) is not None)
    blocks: list[Table | FigureBlock | Text] = [dropped_table(estimate.dropped)] if estimate.dropped else []
    return Section("geometry", "Geometry", "", (*blocks, parameter_table(estimate, names, None)))


def _left_out(results: Mapping[str, Any]) -> tuple[float, float] | None:
    """Mean errors (m) at poses that the selection of terms left out, by order and by place."""
    for step in results.get("term_selection", ()):
        if step["terms"] == results["terms"]:
            return step["order_mm"] * MILLIMETRE, step["workspace_mm"] * MILLIMETRE
    return None


def _statistics(block: Mapping[str, Any]) -> ErrorStatistics:
    mean, p90, largest = (
        math.nan if block[key] is None else block[key] * MILLIMETRE for key in ("mean_mm", "p90_mm", "max_mm")
    )
    return ErrorStatistics(block["poses"], mean, p90, largest)
