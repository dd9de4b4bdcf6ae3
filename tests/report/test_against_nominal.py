"""Checks of a verification against the nominal robot and against the calibration's own verdict."""

import numpy as np
import pytest

from flexcal.report.checks.against_nominal import check_own_verdict, check_smaller_errors


@pytest.mark.parametrize(
    ("factor", "status", "code"),
    [
        (0.3, "good", "improvement"),
        (0.995, "care", "improvement"),
        (1.0, "care", "improvement"),
        (1.3, "care", "worsening"),
    ],
)
def test_smaller_errors(factor: float, status: str, code: str) -> None:
    """Errors that rose are no reason for a no, which those beyond what was predicted are."""
    rng = np.random.default_rng(3)
    before = rng.rayleigh(1e-3, 40)
    after = before[::-1] * factor
    check = check_smaller_errors(before, after)
    assert (check.status, check.code) == (status, code)


def test_a_calibration_that_was_refused_is_not_trusted_by_good_errors() -> None:
    (check,) = check_own_verdict("the prior of other robots does not fit this one")
    assert check.status == "bad"
    assert check_own_verdict("") == ()
