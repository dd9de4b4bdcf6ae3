"""The report of a two-stage calibration: one HTML file that needs nothing else."""

from __future__ import annotations

from pathlib import Path

from flexcal.report.checks import (
    check_claimed_uncertainty,
    check_flanks,
    check_fresh_poses,
    check_rank,
    check_residual,
    check_springs,
    check_truth,
)
from flexcal.report.notation import millimetres, ratio
from flexcal.report.page import Check, Fact, Page, Rung, Status, Verdict, worst
from flexcal.report.render import write_page
from flexcal.report.sections.comparison import comparison_section
from flexcal.report.sections.geometry import geometry_section
from flexcal.report.sections.parameters import coverage
from flexcal.report.sections.provenance import provenance_section
from flexcal.report.sections.springs import spring_names
from flexcal.report.sections.stiffness import stiffness_section
from flexcal.report.sections.verification import verification_section
from flexcal.report.study import TwoStageStudy

TRUST: dict[Status, tuple[str, str]] = {
    "good": ("Yes", "Calibrated, and the numbers can be trusted"),
    "care": ("With care", "Calibrated; read the remarks before relying on it"),
    "bad": ("No", "Do not rely on this calibration yet"),
}
"""Answer and headline by what the worst check says."""


def write_two_stage_report(path: str | Path, study: TwoStageStudy) -> None:
    """Write the report of `study` to `path`, atomically; raises `InputError` where it cannot be written."""
    write_page(path, two_stage_page(study))


def two_stage_page(study: TwoStageStudy) -> Page:
    """The page before it becomes HTML."""
    kind = "simulated robot, its truth known" if study.truth is not None else "measured robot"
    return Page(
        title=f"{study.nominal.name}: calibration report",
        subtitle=f"Two-stage calibration with elastic drives and bearings · {kind}"
        + (f" · seed {study.seed}" if study.seed is not None else ""),
        verdict=two_stage_verdict(study),
        sections=(
            stiffness_section(study),
            geometry_section(study),
            verification_section(study),
            comparison_section(study),
            provenance_section(
                study.command, study.seed, study.seconds, study.calibration.estimate.provenance
            ),
        ),
        document=study.results,
    )


def two_stage_verdict(study: TwoStageStudy) -> Verdict:
    """How accurate it was, how accurate it is, and whether that can be trusted."""
    before, rigid, after = (
        v.all for v in (study.nominal_verification, study.rigid_verification[0], study.elastic_verification)
    )
    checks = two_stage_checks(study)
    status = worst(checks)
    answer, headline = TRUST[status]
    passed = sum(check.status == "good" for check in checks)
    sentence = (
        f"As delivered, the tool was up to {millimetres(before.max)} mm from where it should be. On {after.poses} fresh poses it is now within "
        f"{millimetres(after.p90)} mm at nine of ten and {millimetres(after.max)} mm at worst: {ratio(before.p90, after.p90)} better. The best "
        f"calibration without elasticity would leave {millimetres(rigid.p90)} and {millimetres(rigid.max)} mm."
    )
    return Verdict(
        status,
        headline,
        sentence,
        (
            Fact(
                "How accurate was it?",
                millimetres(before.p90),
                "mm",
                f"9 of 10 poses were within this, as delivered. Mean {millimetres(before.mean)}, worst {millimetres(before.max)} mm.",
            ),
            Fact(
                "How accurate is it?",
                millimetres(after.p90),
                "mm",
                f"9 of 10 poses are within this, calibrated. Mean {millimetres(after.mean)}, worst {millimetres(after.max)} mm.",
            ),
            Fact(
                "Can I trust it?",
                answer,
                "",
                f"{passed} of {len(checks)} checks are good; each is explained below.",
                status,
            ),
        ),
        _rungs(study),
        f"Error of the tool on {after.poses} poses that were not used for the fit, against {study.reference}",
        checks,
    )


def two_stage_checks(study: TwoStageStudy) -> tuple[Check, ...]:
    """The checks behind the verdict."""
    fit, found = study.calibration, study.stiffness.estimate
    stiffness, damping = spring_names(found, "stiffness"), spring_names(found, "damping")
    noise = None if study.truth is not None else study.verification_poses.sigma
    checks = [
        check_fresh_poses(fit, study.elastic_verification),
        check_claimed_uncertainty(study.elastic_verification, noise),
        check_residual(
            "Does noise explain what the geometric fit leaves?", fit.estimate, sigma_given=fit.poses.sigma_given
        ),
        check_residual("Does noise explain what the elastic fit leaves?", found),
        check_springs(found, stiffness, damping),
        check_rank(fit.identifiability),
        check_flanks(study.elastic_verification),
    ]
    if study.truth is not None:
        pairs = (
            coverage(found, stiffness + damping, study.truth),
            coverage(fit.estimate, fit.identifiability.kept_names, study.truth),
        )
        covered, total = (sum(pair[k] for pair in pairs) for k in (0, 1))
        if total:
            checks.append(check_truth(covered, total))
    return tuple(checks)


def _rungs(study: TwoStageStudy) -> tuple[Rung, ...]:
    before, after = study.nominal_verification.all, study.elastic_verification.all
    rungs = [Rung("as delivered", before.mean, before.p90, before.max, "nominal")]
    for fit, verification in zip(study.rigid, study.rigid_verification, strict=True):
        s = verification.all
        rungs.append(Rung(f"rigid, {len(fit.poses)} poses", s.mean, s.p90, s.max, "rigid"))
    if study.paper is not None and study.paper.rigid is not None:
        s = study.paper.rigid
        rungs.append(Rung("paper: rigid, hardware", s.mean, s.p90, s.max, "published"))
    rungs.append(
        Rung(f"elastic, {len(study.calibration.poses)} poses", after.mean, after.p90, after.max, "elastic")
    )
    if study.paper is not None and study.paper.elastic is not None:
        s = study.paper.elastic
        rungs.append(Rung("paper: elastic, hardware", s.mean, s.p90, s.max, "published"))
    if study.floor is not None:
        s = study.floor
        rungs.append(Rung("floor: all known", s.mean, s.p90, s.max, "floor"))
    return tuple(rungs)
