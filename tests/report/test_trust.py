"""The verdict: trusted only where an independent check passed and nothing speaks against it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexcal.calibration.verification import ErrorScale
from flexcal.report.checks import Trust, check_held_out, check_left_out, prediction_checks
from flexcal.report.checks.verdict import NO_INDEPENDENT_CHECK, PHRASES
from flexcal.report.layout import Check, Status
from flexcal.report.pages import two_stage_checks
from flexcal.report.pages.two_stage import truth_checks, two_stage_page
from flexcal.report.results import TwoStageStudy


def judged(status: Status, code: str, *, independent: bool = False) -> Check:
    return Check("question", "answer", status, code, independent)


@pytest.mark.parametrize(
    ("checks", "trusted", "reasons"),
    [
        ([("good", "held_out", True), ("good", "residual", False)], True, ["held_out"]),
        ([("good", "residual", False)], None, [NO_INDEPENDENT_CHECK]),
        ([("care", "drift", False)], None, [NO_INDEPENDENT_CHECK, "drift"]),
        ([("unknown", "left_out", True), ("good", "residual", False)], None, ["left_out"]),
        ([("good", "held_out", True), ("care", "joints", False)], None, ["joints"]),
        ([("good", "held_out", True), ("unknown", "residual", False)], True, ["held_out"]),
        ([("care", "left_out", True)], None, ["left_out"]),
        ([("bad", "residual", False), ("good", "left_out", True)], False, ["residual"]),
        ([("bad", "residual", False), ("unknown", "left_out", True)], False, ["residual"]),
        ([("good", "unseen_poses", True), ("unknown", "claimed_uncertainty", True)], None, ["claimed_uncertainty"]),
        ([], None, [NO_INDEPENDENT_CHECK]),
    ],
)  # fmt: skip
def test_verdict_of_checks(
    checks: list[tuple[Status, str, bool]], trusted: bool | None, reasons: list[str]
) -> None:
    trust = Trust(tuple(judged(status, code, independent=alone) for status, code, alone in checks))
    assert trust.document() == {"trusted": trusted, "reasons": reasons}
    word = trust.sentence.removeprefix("Trusted: ").partition(" — because ")[0]
    assert (word == "yes") == (trusted is True) and (word == "no") == (trusted is False)
    assert (trust.status == "good") == (trusted is True)


def test_demo_is_judged_without_its_truth(study: TwoStageStudy) -> None:
    checks = two_stage_checks(study)
    assert Trust(checks).document() == {"trusted": True, "reasons": ["fresh_poses", "claimed_uncertainty"]}
    assert all(check.code in PHRASES for check in checks)
    shown = two_stage_page(study).verdict.checks
    assert [check.code for check in shown] == [check.code for check in (*checks, *truth_checks(study))]


def scale(factor: float, low: float, high: float, poses: int = 40, *, noise_known: bool = True) -> ErrorScale:
    return ErrorScale(factor, low, high, factor, low, high, 20.0, np.linspace(0.01, 0.99, poses), noise_known)


def test_map_and_certificate_are_judged_by_measured_poses() -> None:
    def trusted(found: ErrorScale | None, fitted: tuple[str, ...] = ()) -> bool | None:
        return Trust(prediction_checks(found, fitted)).trusted

    assert trusted(scale(1.0, 0.8, 1.3)) is True and trusted(scale(0.6, 0.5, 0.8)) is True
    assert trusted(None) is None and trusted(scale(1.0, 0.8, 1.3), ("fit.csv",)) is None
    assert trusted(scale(1.6, 1.2, 2.0)) is None and trusted(scale(3.0, 2.1, 4.0)) is False
    assert trusted(scale(3.0, 2.1, 4.0, noise_known=False)) is None
    assert trusted(scale(1.0, 0.7, 1.6, poses=10)) is None


def test_expected_cross_validation_error_is_that_of_linear_regression(rng: np.random.Generator) -> None:
    """Of 150 coordinates and 15 parameters, leave-one-out errors are as the formula has them."""
    ratios = []
    for _ in range(40):
        jacobian, noise = rng.normal(size=(150, 15)), rng.normal(size=150)
        hat = jacobian @ np.linalg.pinv(jacobian)
        residual = noise - hat @ noise
        left_out = residual / (1 - np.diag(hat))
        ratios.append(np.sqrt((left_out**2).mean() / (residual**2).mean()))
    expected = np.sqrt(1.1 / 0.9)
    assert np.mean(ratios) == pytest.approx(expected, rel=0.02)
    observed = 1e-4 * float(np.mean(ratios))
    for factor, status in ((1.0, "good"), (1.4, "care")):
        mean = factor * observed / 1e-3
        groups = {"by": "day", "groups": {"monday": {"mean_mm": mean}}, "mean_mm": mean}
        assert check_held_out(groups, 1e-4, 0.1).status == status
        assert check_left_out(1e-4, factor * observed, 1e-4 * expected).status == status
    assert check_left_out(1e-4, None, None).status == "unknown"


def test_bad_checks_are_named(study: TwoStageStudy) -> None:
    lost = replace(study.geometry, status="stalled", message="no descent")
    blocks = {**study.estimates, "calibration": lost}
    trust = Trust(two_stage_checks(replace(study, estimates=blocks)))
    assert trust.document() == {"trusted": False, "reasons": ["residual"]}
    assert (
        trust.sentence == "Trusted: no — because the robot as declared does not explain the measured points"
    )
