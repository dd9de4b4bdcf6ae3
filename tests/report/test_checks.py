"""The verdict follows from the results, and turns bad when they do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.calibration import Calibration, Drift, predict
from flexcal.report import TwoStageStudy
from flexcal.report.checks import (
    CHANCE,
    check_claimed_uncertainty,
    check_drift,
    check_flanks,
    check_fresh_poses,
    check_rank,
    check_residual,
    check_truth,
)
from flexcal.report.measured_points import CALIBRATED
from flexcal.report.two_stage import two_stage_checks, two_stage_verdict
from flexcal.workflow.two_stage_run import TwoStageRun


def test_a_good_study_passes_every_check(study: TwoStageStudy) -> None:
    assert [c.question for c in two_stage_checks(study) if c.status != "good"] == []
    assert two_stage_verdict(study).status == "good"


def test_errors_larger_than_predicted_are_bad(study: TwoStageStudy) -> None:
    worse = replace(study.verification, errors=4.0 * study.verification.errors)
    assert check_claimed_uncertainty(worse).status == "bad"
    fresh = replace(study.fresh, errors={**study.fresh.errors, CALIBRATED: worse.errors})
    assert two_stage_verdict(replace(study, fresh=fresh)).status == "bad"


def test_noise_of_the_instrument_counts_where_points_are_measured(simulated: TwoStageRun) -> None:
    measured, sigma = simulated.measured_verification, simulated.verification_poses.sigma
    assert check_claimed_uncertainty(measured).status != "good"
    assert check_claimed_uncertainty(measured, sigma).status == "good"


def test_without_noise_nothing_is_claimed(study: TwoStageStudy) -> None:
    checked = check_claimed_uncertainty(study.verification, noise_given=False)
    assert checked.status == "unknown"


def test_few_or_much_worse_fresh_poses_are_flagged(study: TwoStageStudy) -> None:
    v = study.verification
    few = replace(
        v,
        errors=v.errors[:9],
        parameter_rms=v.parameter_rms[:9],
        ambiguous=v.ambiguous[:9],
        position=v.position[:9],
    )
    fitted = study.points.statistics(CALIBRATED)
    assert check_fresh_poses(fitted, few.all).status == "care"
    assert check_fresh_poses(fitted, replace(v, errors=9 * v.errors).all).status == "care"


def test_chi2_is_judged(study: TwoStageStudy) -> None:
    estimate = study.geometry
    freedom = estimate.degrees_of_freedom
    by_size = {
        k: check_residual("q", replace(estimate, chi2=k * freedom)).status for k in (0.2, 1.0, 2.0, 9.0)
    }
    assert by_size == {0.2: "care", 1.0: "good", 2.0: "care", 9.0: "bad"}
    assert check_residual("q", replace(estimate, status="stalled", message="no descent")).status == "bad"
    assert check_residual("q", estimate, sigma_given=False).status == "unknown"


def test_a_drift_is_flagged(simulated: TwoStageRun) -> None:
    fit = simulated.calibration

    def judged(calibration: Calibration) -> str:
        drift = Drift.of(calibration)
        return check_drift(drift.document()).status

    assert judged(fit) == "good"
    share = np.linspace(-0.5, 0.5, len(fit.poses))
    wandered = fit.residuals + share[:, None] * np.array([1e-4, 0.0, 0.0])
    assert judged(replace(fit, residuals=wandered)) == "care"


def test_a_blurred_gap_is_flagged(study: TwoStageStudy) -> None:
    found = study.determined
    assert check_rank(found.parameters, found.rank, found.gap).status == "good"
    assert check_rank(found.parameters, found.rank, 1.2).status == "care"


def test_many_uncertain_flanks_are_flagged(study: TwoStageStudy) -> None:
    v = study.verification
    assert check_flanks(replace(v, ambiguous=np.zeros(150, dtype=bool))).status == "good"
    assert check_flanks(replace(v, ambiguous=np.arange(150) % 3 == 0)).status == "care"


def test_coverage_is_judged() -> None:
    assert [check_truth(k, 20).status for k in (19, 16, 10)] == ["good", "care", "bad"]


def test_fresh_poses_are_judged_as_the_tracker_reads_them(
    study: TwoStageStudy, simulated: TwoStageRun
) -> None:
    """What a folder keeps are the measured errors, which hold the stated noise, and beside them those against the truth."""
    np.testing.assert_allclose(study.fresh.calibrated, simulated.measured_verification.errors, atol=1e-12)
    np.testing.assert_allclose(study.exact.calibrated, simulated.elastic_verification.errors, atol=1e-12)
    np.testing.assert_allclose(study.noise, simulated.verification_poses.sigma, rtol=1e-12)
    more = (study.fresh.calibrated**2).mean() - (study.exact.calibrated**2).mean()
    assert abs(more / (study.noise**2).mean() - 1) < 0.2


def test_chance_is_one_in_a_hundred(simulated: TwoStageRun, rng: np.random.Generator) -> None:
    model = simulated.calibration.model
    posterior = model.posterior
    names = [n for n in posterior.parameters.names if not n.endswith(".damping")]
    numbers = [posterior.parameters.index(n) for n in names]
    parameters = posterior.parameters.subset(names)
    slopes = parameters.natural_slope(parameters.coordinates())
    jacobian = predict(model, simulated.verification_poses, jacobians=True).jacobian(names) * slopes
    draws = rng.multivariate_normal(
        np.zeros(len(names)), posterior.covariance[np.ix_(numbers, numbers)], 3000
    )
    errors = draws @ jacobian.reshape(-1, len(names)).T
    ratios = np.sqrt((errors**2).sum(axis=1) / (simulated.elastic_verification.parameter_rms**2).sum())
    assert abs(np.quantile(ratios, 0.99) - CHANCE) < 0.07
