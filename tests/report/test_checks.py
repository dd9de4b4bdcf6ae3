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
from flexcal.report.two_stage import two_stage_checks, two_stage_verdict


def test_a_good_study_passes_every_check(study: TwoStageStudy) -> None:
    assert [c.question for c in two_stage_checks(study) if c.status != "good"] == []
    assert two_stage_verdict(study).status == "good"


def test_errors_larger_than_predicted_are_bad(study: TwoStageStudy) -> None:
    worse = replace(study.elastic_verification, errors=4.0 * study.elastic_verification.errors)
    assert check_claimed_uncertainty(worse).status == "bad"
    assert two_stage_verdict(replace(study, elastic_verification=worse)).status == "bad"


def test_noise_of_the_instrument_counts_where_points_are_measured(study: TwoStageStudy) -> None:
    assert study.measured_verification is not None and study.measured_poses is not None
    assert check_claimed_uncertainty(study.measured_verification).status != "good"
    assert check_claimed_uncertainty(study.measured_verification, study.measured_poses.sigma).status == "good"


def test_without_noise_nothing_is_claimed(study: TwoStageStudy) -> None:
    checked = check_claimed_uncertainty(study.elastic_verification, noise_given=False)
    assert checked.status == "unknown"


def test_few_or_much_worse_fresh_poses_are_flagged(study: TwoStageStudy) -> None:
    v = study.elastic_verification
    few = replace(
        v,
        errors=v.errors[:9],
        parameter_rms=v.parameter_rms[:9],
        ambiguous=v.ambiguous[:9],
        position=v.position[:9],
    )
    assert check_fresh_poses(study.calibration.errors, few.all).status == "care"
    assert check_fresh_poses(study.calibration.errors, replace(v, errors=9 * v.errors).all).status == "care"


def test_chi2_is_judged(study: TwoStageStudy) -> None:
    estimate = study.calibration.estimate
    freedom = estimate.degrees_of_freedom
    by_size = {
        k: check_residual("q", replace(estimate, chi2=k * freedom)).status for k in (0.2, 1.0, 2.0, 9.0)
    }
    assert by_size == {0.2: "care", 1.0: "good", 2.0: "care", 9.0: "bad"}
    assert check_residual("q", replace(estimate, status="stalled", message="no descent")).status == "bad"
    assert check_residual("q", estimate, sigma_given=False).status == "unknown"


def test_a_drift_is_flagged(study: TwoStageStudy) -> None:
    fit = study.calibration

    def judged(calibration: Calibration) -> str:
        drift = Drift.of(calibration)
        return check_drift(drift.distance, certain=drift.certain).status

    assert judged(fit) == "good"
    share = np.linspace(-0.5, 0.5, len(fit.poses))
    wandered = fit.residuals + share[:, None] * np.array([1e-4, 0.0, 0.0])
    assert judged(replace(fit, residuals=wandered)) == "care"


def test_a_blurred_gap_is_flagged(study: TwoStageStudy) -> None:
    found = study.calibration.identifiability
    assert check_rank(len(found.names), found.rank, found.gap).status == "good"
    assert check_rank(len(found.names), found.rank, 1.2).status == "care"


def test_many_uncertain_flanks_are_flagged(study: TwoStageStudy) -> None:
    v = study.elastic_verification
    assert check_flanks(replace(v, ambiguous=np.zeros(150, dtype=bool))).status == "good"
    assert check_flanks(replace(v, ambiguous=np.arange(150) % 3 == 0)).status == "care"


def test_coverage_is_judged() -> None:
    assert [check_truth(k, 20).status for k in (19, 16, 10)] == ["good", "care", "bad"]


def test_the_floor_counts_against_the_truth(study: TwoStageStudy) -> None:
    noise = study.unpredicted_noise
    assert noise is not None and study.floor is not None
    draws = noise[0] * np.random.default_rng(3).normal(size=(20000, 3))
    np.testing.assert_allclose(np.linalg.norm(draws, axis=1).mean(), study.floor.mean, rtol=0.02)
    np.testing.assert_array_equal(
        replace(study, truth=None).unpredicted_noise, study.verification_poses.sigma
    )


def test_chance_is_one_in_a_hundred(study: TwoStageStudy, rng: np.random.Generator) -> None:
    model = study.calibration.model
    posterior = model.posterior
    names = [n for n in posterior.parameters.names if not n.endswith(".damping")]
    numbers = [posterior.parameters.index(n) for n in names]
    parameters = posterior.parameters.subset(names)
    slopes = parameters.natural_slope(parameters.coordinates())
    jacobian = predict(model, study.verification_poses, jacobians=True).jacobian(names) * slopes
    draws = rng.multivariate_normal(
        np.zeros(len(names)), posterior.covariance[np.ix_(numbers, numbers)], 3000
    )
    errors = draws @ jacobian.reshape(-1, len(names)).T
    ratios = np.sqrt((errors**2).sum(axis=1) / (study.elastic_verification.parameter_rms**2).sum())
    assert abs(np.quantile(ratios, 0.99) - CHANCE) < 0.07
