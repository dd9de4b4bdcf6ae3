"""Tails of chi-square and F against SciPy's."""

import pytest
from scipy.special import chdtri, fdtrc

from flexcal.estimation import chi_square_limit, f_tail


@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 9, 30])
@pytest.mark.parametrize("probability", [0.3, 0.05, 1e-3, 1e-8, 1e-30])
def test_limits_of_chi_square(probability: float, freedom: int) -> None:
    assert chi_square_limit(freedom, probability) == pytest.approx(chdtri(freedom, probability), rel=1e-12)


@pytest.mark.parametrize("first", [1, 2, 3, 40, 300])
@pytest.mark.parametrize("second", [1, 2, 7, 55, 3000])
@pytest.mark.parametrize("ratio", [0.01, 0.5, 1.0, 1.3, 4.0, 60.0])
def test_tail_of_f(ratio: float, second: int, first: int) -> None:
    assert f_tail(first, second, ratio) == pytest.approx(fdtrc(first, second, ratio), rel=1e-9, abs=1e-290)


def test_tail_of_f_at_its_ends() -> None:
    assert (f_tail(3, 40, 0.0), f_tail(3, 40, float("inf"))) == (1.0, 0.0)
