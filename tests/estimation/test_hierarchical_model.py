"""The population of individuals that were measured: mean, spread, and the prior of the next."""

import numpy as np
import pytest
from over_seeds import over_seeds

from flexcal.estimation import Measured, population


def measured(parameters: np.ndarray, noise: float, rng: np.random.Generator) -> list[Measured]:
    size = parameters.shape[1]
    rows = np.eye(size) / noise
    return [Measured(rows, rows @ own + rng.standard_normal(size)) for own in parameters]


@pytest.mark.statistical
def test_many_individuals_give_the_moments_of_the_balanced_random_effects_model() -> None:
    """With equal errors the REML estimate of the variance is s² - v (Searle, Casella and McCulloch 1992, section 3.8)."""
    rng = np.random.default_rng(4)
    true = np.array([0.5, -1.0, 0.2]) + np.array([0.2, 0.4, 0.1]) * rng.standard_normal((150, 3))
    individuals = measured(true, 0.15, rng)
    observed = np.array([own.observed * 0.15 for own in individuals])
    result = population(individuals, np.ones(3), ["a", "b", "c"])
    np.testing.assert_allclose(result.mean, observed.mean(axis=0), atol=0.01)
    reml = observed.var(axis=0, ddof=1) - 0.15**2
    np.testing.assert_allclose(result.spread**2, reml, rtol=0.12, atol=0.003)
    np.testing.assert_allclose(
        np.sqrt(np.diag(result.uncertainty)), np.sqrt((reml + 0.15**2) / 150), rtol=0.1
    )


def test_a_sum_that_was_measured_is_known_and_its_terms_are_not() -> None:
    rng = np.random.default_rng(5)
    sums = 0.4 + 0.05 * rng.standard_normal(12)
    row = np.array([[1.0, 1.0, 0.0]]) / 0.01
    result = population(
        [Measured(row, row[:, 0] * s + rng.standard_normal(1)) for s in sums], np.ones(3), ["a", "a", "a"]
    )
    together = np.array([1.0, 1.0, 0.0])
    assert together @ result.mean == pytest.approx(0.4, abs=0.06)
    assert together @ result.uncertainty @ together < 0.05**2
    assert result.uncertainty[0, 0] == pytest.approx(0.5, abs=0.02)
    assert result.uncertainty[2, 2] == pytest.approx(1.0, abs=1e-9)
    assert together @ result.covariance @ together == pytest.approx(0.05**2, rel=1.2)


def test_the_same_individuals_give_the_same_numbers() -> None:
    individuals = measured(np.random.default_rng(6).standard_normal((4, 2)), 0.1, np.random.default_rng(7))
    one, other = (population(individuals, np.ones(2), ["a", "a"]) for _ in range(2))
    assert (one.covariance == other.covariance).all()


def next_inside(seed: int, count: int) -> np.ndarray:
    """Whether 40 parameters of the next individual lie in their intervals."""
    rng = np.random.default_rng(seed)
    spread = 0.15 * np.exp(0.5 * rng.standard_normal(40))
    every = rng.normal(0, 0.3, 40) + spread * rng.standard_normal((count + 1, 40))
    result = population(measured(every[:-1], 0.05, rng), np.ones(40), ["a"] * 20 + ["b"] * 20)
    return np.abs(every[-1] - result.mean) < 1.96 * np.sqrt(np.diag(result.covariance))


@pytest.mark.slow
@pytest.mark.parametrize(("count", "seeds"), [(2, 16), (3, 16), (8, 10), (30, 6)])
def test_intervals_of_the_next_individual_cover_it(count: int, seeds: int) -> None:
    """Of 95 % intervals, 93 to 97 % within the scatter of so many; spreads differ by factors within a kind."""
    inside = over_seeds(next_inside, range(100, 100 + seeds), count)
    share, scatter = float(np.mean(inside)), np.sqrt(0.95 * 0.05 / np.size(inside))
    assert 0.93 - 2 * scatter < share < 0.97 + 2 * scatter
