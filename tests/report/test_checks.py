"""The verdict follows from the results, and turns bad when they do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexcal.calibration.diagnostics import Drift
from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.measurement import moving_parameters, predict_measurements
from flexcal.calibration.verification import CALIBRATED, prediction_document
from flexcal.jobs.two_stage import TwoStageRun
from flexcal.report.checks import (
    check_claimed_uncertainty,
    check_drift,
    check_error_budget,
    check_flanks,
    check_fresh_poses,
    check_rank,
    check_residual,
    check_truth,
)
from flexcal.report.checks.pose_errors import CHANCE
from flexcal.report.pages import two_stage_checks
from flexcal.report.pages.two_stage import two_stage_verdict
from flexcal.report.results import TwoStageStudy


def test_a_good_study_passes_every_check(study: TwoStageStudy) -> None:
    assert [c.question for c in two_stage_checks(study) if c.status != "good"] == []
    assert two_stage_verdict(study).status == "good"


def test_errors_larger_than_predicted_are_bad(study: TwoStageStudy) -> None:
    worse = study.results["prediction"] | {"ratio": 4.0, "ratio_low": 3.2, "ratio_high": 5.0}
    assert check_claimed_uncertainty(worse).status == "bad"
    assert two_stage_verdict(replace(study, results=study.results | {"prediction": worse})).status == "bad"


def test_noise_of_the_instrument_counts_where_points_are_measured(simulated: TwoStageRun) -> None:
    measured, covariance = simulated.measured_verification, simulated.measured_covariance
    assert check_claimed_uncertainty(prediction_document(measured, covariance)).status == "good"
    without = replace(covariance, independent=np.zeros((len(measured.errors), 3, 3)))
    assert check_claimed_uncertainty(prediction_document(measured, without)).status != "good"
    unknown = replace(covariance, independent=None)
    assert check_claimed_uncertainty(prediction_document(measured, unknown)).status == "unknown"


@pytest.mark.parametrize(
    ("ratio", "low", "high", "freedom", "status"),
    [
        (1.0, 0.8, 1.3, 30, "good"),
        (0.5, 0.4, 0.7, 30, "good"),
        (1.3, 1.1, 1.5, 60, "care"),
        (1.4, 0.9, 1.9, 10, "care"),
        (2.5, 2.0, 3.0, 30, "bad"),
        (2.5, 0.9, 5.0, 3, "care"),
        (1.0, 0.5, 2.9, 3, "unknown"),
    ],
)
def test_the_ratio_decides_with_its_interval(
    ratio: float, low: float, high: float, freedom: float, status: str
) -> None:
    found = {"poses": 50, "inside_95_percent": 0.95, "verdict": "right", "freedom": freedom}
    found |= {"ratio": ratio, "ratio_low": low, "ratio_high": high}
    assert check_claimed_uncertainty(found).status == status
    assert check_claimed_uncertainty(None).status == "unknown"


def test_the_error_budget_is_judged(study: TwoStageStudy) -> None:
    good = {"instrument_mm": 0.02, "robot_mm": 0.03, "model_mm": 0.01, "stated_mm": 0.02}

    def judged(changes: dict[str, float | None], *, is_implausible: bool = False) -> tuple[str, str]:
        found = check_error_budget(study.geometry, good | changes, is_implausible=is_implausible)
        return found.status, found.code

    unstated = {"instrument_mm": None, "stated_mm": None}
    assert judged({}) == judged(unstated) == ("good", "residual")
    assert judged({"model_mm": 0.05}) == judged(unstated | {"model_mm": 0.05}) == ("care", "model_error")
    assert judged({"instrument_mm": None, "stated_mm": None, "robot_mm": 0.0, "model_mm": 1e-6})[0] == "good"
    assert judged({"stated_mm": 0.2}) == ("care", "residual")
    assert judged({}, is_implausible=True) == ("bad", "residual")


def test_few_or_much_worse_fresh_poses_are_flagged(study: TwoStageStudy) -> None:
    v = study.verification
    few = replace(
        v,
        errors=v.errors[:9],
        parameter_rms=v.parameter_rms[:9],
        scatter_rms=v.scatter_rms[:9],
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


def test_a_drift_is_flagged(simulated: TwoStageRun) -> None:
    fit = simulated.calibration

    def judged(calibration: GeometricFit) -> str:
        return check_drift(Drift.of(calibration).document()).status

    assert judged(fit) == "good"
    share = np.linspace(-0.5, 0.5, len(fit.poses))
    wandered = fit.linear.residual + share[:, None] * np.array([1e-4, 0.0, 0.0])
    assert judged(replace(fit, linear=replace(fit.linear, residual=wandered))) == "care"


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
    np.testing.assert_allclose(study.fresh.poses.sigma, simulated.verification_poses.sigma, rtol=1e-12)
    more = (study.fresh.calibrated**2).mean() - (study.exact.calibrated**2).mean()
    assert abs(more / (study.fresh.poses.sigma**2).mean() - 1) < 0.2


def test_chance_is_one_in_a_hundred(simulated: TwoStageRun, rng: np.random.Generator) -> None:
    model = simulated.calibration.model
    posterior = model.posterior
    names = moving_parameters(model)
    numbers = [posterior.parameters.index(n) for n in names]
    parameters = posterior.parameters.subset(names)
    slopes = parameters.natural_slope(parameters.coordinates())
    jacobian = (
        predict_measurements(model, simulated.verification_poses, jacobians=True).jacobian(names) * slopes
    )
    draws = rng.multivariate_normal(
        np.zeros(len(names)), posterior.covariance[np.ix_(numbers, numbers)], 3000
    )
    errors = draws @ jacobian.reshape(-1, len(names)).T
    ratios = np.sqrt((errors**2).sum(axis=1) / (simulated.elastic_verification.parameter_rms**2).sum())
    assert abs(np.quantile(ratios, 0.99) - CHANCE) < 0.07
