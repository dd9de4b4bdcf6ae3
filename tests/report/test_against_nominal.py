"""Checks of a verification against the nominal robot and against the calibration's own verdict."""

import numpy as np
import pytest

from flexcal.report.checks.against_nominal import check_own_verdict, check_smaller_errors


@pytest.mark.parametrize(
    ("factor", "status"),
    [(0.3, "good"), (0.995, "care"), (1.0, "care"), (1.3, "bad")],
)
def test_smaller_errors(factor: float, status: str) -> None:
    rng = np.random.default_rng(3)
    before = rng.rayleigh(1e-3, 40)
    after = before[::-1] * factor
    assert check_smaller_errors(before, after).status == status


def test_a_calibration_that_was_refused_is_not_trusted_by_good_errors() -> None:
    (check,) = check_own_verdict("the prior of other robots does not fit this one")
    assert check.status == "bad"
    assert check_own_verdict("") == ()
