"""Variances of three degrees of freedom: intervals with their moderated values hold what they should."""

import numpy as np
import pytest
from scipy.stats import t as student

from flexcal.dynamics.estimators.periodic_likelihood import moderated


@pytest.mark.parametrize("spread", [0.0, 1.0, 6.0], ids=["equal", "unlike", "unlike by orders"])
def test_intervals_hold_zero(spread: float, rng: np.random.Generator) -> None:
    held, freedoms = [], []
    for _ in range(400):
        true = np.exp(0.5 * spread * rng.normal(size=13))
        seen, freedom = moderated(true**2 * rng.chisquare(3, 13) / 3, 3)
        held.append(np.abs(true * rng.normal(size=13)) < student.ppf(0.975, freedom) * np.sqrt(seen))
        freedoms.append(freedom)
    assert 0.92 < np.mean(held) < 0.97
    assert np.median(freedoms) > 20 if spread == 0 else np.median(freedoms) < 10


def test_a_single_variance_is_itself() -> None:
    assert moderated(np.array([4.0]), 3) == (4.0, 3)
