"""Quantiles of Student's t against SciPy's."""

import pytest
from scipy.special import stdtrit

from flexcal.estimation import student_quantile


@pytest.mark.parametrize("freedom", [1.0, 1.5, 2.0, 4.71, 12.0, 38.4, 99.9])
@pytest.mark.parametrize("probability", [0.5, 0.6, 0.975, 0.999])
def test_quantiles(probability: float, freedom: float) -> None:
    assert student_quantile(probability, freedom) == pytest.approx(
        stdtrit(freedom, probability), rel=1e-11, abs=1e-13
    )
