"""Vuong's statistic against densities of SciPy and sums by hand."""

import numpy as np
import pytest
from scipy.stats import norm

from flexcal.estimation import vuong_statistic


def test_it_is_the_standardised_gain_in_log_likelihood(rng: np.random.Generator) -> None:
    """Both for residuals of usual size and for those of micrometres; positive where the first model is better."""
    groups = np.repeat(np.arange(12), [5, 3, 4] * 4)
    for size in (1.0, 1e-6):
        first = size * rng.normal(size=len(groups))
        second = first + 0.5 * size * rng.normal(size=len(groups))
        densities = [norm.logpdf(r, scale=np.sqrt(np.mean(r**2))) for r in (first, second)]
        gains = [np.sum((densities[0] - densities[1])[groups == g]) for g in range(12)]
        expected = np.sum(gains) / (np.sqrt(12) * np.std(gains))
        assert abs(expected) > 0.1
        assert vuong_statistic(first, second, groups) == pytest.approx(expected, rel=1e-9)
        assert vuong_statistic(second, first, groups) == pytest.approx(-expected, rel=1e-9)
        more = (np.sum(gains) + 3.0) / (np.sqrt(12) * np.std(gains))
        assert vuong_statistic(first, second, groups, 3.0) == pytest.approx(more, rel=1e-9)


def test_a_small_spread_is_a_spread() -> None:
    """Gains that hardly differ between groups make a great statistic."""
    first = np.tile([0.01, -0.01, 0.0101], 4)
    second = 1.001 * first + np.repeat([0.0, 1e-6, 0.0, -1e-6], 3)
    assert abs(vuong_statistic(first, second, np.repeat(np.arange(4), 3))) > 0


def test_equal_models_are_equally_good(rng: np.random.Generator) -> None:
    residual = rng.normal(size=8)
    assert vuong_statistic(residual, residual, np.arange(8)) == 0.0
