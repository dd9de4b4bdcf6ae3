"""The report of a two-stage calibration: one self-contained HTML file."""

from __future__ import annotations

from flexcal.calibration.verification import CALIBRATED, RIGID
from flexcal.report.checks import (
    Trust,
    check_claimed_uncertainty,
    check_drift,
    check_error_budget,
    check_flanks,
    check_fresh_poses,
    check_rank,
    check_responses,
    check_springs,
    check_truth,
)
from flexcal.report.layout import (
    TRUTH,
    Check,
    ErrorRange,
    Page,
    Verdict,
    millimetres,
    ratio,
)
from flexcal.report.pages.calibration import HEADLINES
from flexcal.report.results import TwoStageStudy
from flexcal.report.sections import (
    common_origin,
    comparison_section,
    coverage,
    error_range,
    geometry_section,
    headline_facts,
    link_inertials_section,
    provenance_section,
    residuals_section,
    stiffness_section,
    uncalibrated_ranges,
    verification_section,
)

_ROBOTS = {
    "virtual": "simulated robot, its truth known",
    "hard": "simulated robot, independent of the identified model",
}


def two_stage_page(study: TwoStageStudy) -> Page:
    """The page before it becomes HTML."""
    before, results, points = link_inertials_section(study), study.results, study.points
    return Page(
        title=f"{results['robot']}: calibration report",
        subtitle=f"Two-stage calibration with elastic drives and bearings · {_ROBOTS[results['cell']]} · seed {results['seed']}",
        verdict=two_stage_verdict(study),
        sections=(
            verification_section(study),
            geometry_section(study),
            residuals_section(results["joints"], points.poses, points.calibrated, study.geometry.outliers),
            stiffness_section(study),
            *([before] if before is not None else []),
            comparison_section(study),
            provenance_section(
                results["command"], results["seed"], results["seconds"], common_origin(study.estimates)
            ),
        ),
        document=results,
    )


def two_stage_verdict(study: TwoStageStudy) -> Verdict:
    """Accuracy before and after calibration, and the verdict."""
    before = study.fresh.before
    assert before is not None
    rigid, after = (study.fresh.statistics(model) for model in (RIGID, CALIBRATED))
    checks = two_stage_checks(study)
    trust = Trust(checks)
    sentence = (
        f"Before, the robot's own error was up to {millimetres(before.max)} mm. On {after.poses} fresh poses the "
        f"calibrated robot has a P90 of {millimetres(after.p90)} mm and a maximum of {millimetres(after.max)} mm: "
        f"{ratio(before.p90, after.p90)} "
        f"better. The best calibration without elasticity would leave {millimetres(rigid.p90)} and {millimetres(rigid.max)} mm."
    )
    return Verdict(
        trust.status,
        HEADLINES[trust.status],
        sentence,
        headline_facts(before, after, trust, "poses"),
        _rungs(study),
        f"Error of the tool on {after.poses} poses that were not used for the fit, as the tracker reads them",
        (*checks, *truth_checks(study)),
    )


def two_stage_checks(study: TwoStageStudy) -> tuple[Check, ...]:
    """The checks behind the verdict: those that a real robot would have too."""
    stiffness_study, geometry, determined, fresh = (
        study.stiffness,
        study.geometry,
        study.determined,
        study.verification,
    )
    stiffness, damping = study.springs("stiffness"), study.springs("damping")
    bad_data = study.results["calibration_fit"]["is_implausible"]
    return (
        check_fresh_poses(study.points.statistics(CALIBRATED), fresh.all).named(
            "fresh_poses", independent=True
        ),
        check_claimed_uncertainty(study.results["prediction"]).named("claimed_uncertainty", independent=True),
        check_error_budget(geometry, study.results["variances"], is_implausible=bad_data),
        check_responses(stiffness_study),
        check_drift(study.results["calibration_fit"]["drift"]).named("drift"),
        check_springs(stiffness_study, stiffness, damping).named("springs"),
        check_rank(determined.parameters, determined.rank, determined.gap).named("rank"),
        check_flanks(fresh).named("flanks"),
    )


def truth_checks(study: TwoStageStudy) -> tuple[Check, ...]:
    """Comparison with the true parameters; not part of the verdict, because they are unknown for a real robot."""
    springs = study.springs("stiffness") + study.springs("damping")
    pairs = (
        coverage(study.stiffness, springs, study.truth),
        coverage(study.geometry, study.kept, study.truth),
    )
    covered, total = (sum(pair[k] for pair in pairs) for k in (0, 1))
    return (check_truth(covered, total).named(TRUTH),) if total else ()


def _rungs(study: TwoStageStudy) -> tuple[ErrorRange, ...]:
    paper = study.paper
    ranges = uncalibrated_ranges(study.fresh)
    ranges += [error_range(f"rigid, {fit.poses} poses", fit.errors, "rigid") for fit in study.rigid]
    if paper is not None and paper.rigid is not None:
        ranges.append(error_range("paper: rigid, hardware", paper.rigid, "published"))
    words = f"elastic, {len(study.points.poses)} poses"
    ranges.append(error_range(words, study.fresh.statistics(CALIBRATED), "elastic"))
    if paper is not None and paper.elastic is not None:
        ranges.append(error_range("paper: elastic, hardware", paper.elastic, "published"))
    if study.floor is not None:
        ranges.append(error_range("floor: all known", study.floor, "floor"))
    return tuple(ranges)
