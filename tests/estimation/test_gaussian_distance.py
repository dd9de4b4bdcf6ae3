"""Mean, quantile and probability of the length of a Gaussian vector, against chi distributions, drawn vectors and another integral."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import elliprg
from scipy.stats import chi

from flexcal.estimation import distance_probability, distance_quantile, mean_distance, principal_variances


@pytest.mark.parametrize("freedom", [1, 2, 3])
def test_alike_in_some_directions_is_a_chi_distribution(freedom: int) -> None:
    variances = np.array([[4.0] * freedom + [0.0] * (3 - freedom)])
    assert distance_quantile(variances)[0] == pytest.approx(2 * chi(freedom).ppf(0.95), rel=2e-6)
    assert mean_distance(variances)[0] == pytest.approx(2 * chi(freedom).mean(), rel=1e-12)
    below = distance_probability(np.array([3.0]), variances)[0]
    assert below == pytest.approx(chi(freedom).cdf(1.5), abs=1e-6)


@pytest.mark.parametrize("std", [(1.0, 0.9, 0.8), (1.0, 0.5, 0.02), (1.0, 0.3, 0.2), (1.0, 1.0, 0.3)])
def test_unlike_directions_against_imhofs_integral(std: tuple[float, float, float]) -> None:
    """P(Σ λ z² ≤ x) by the inversion of its characteristic function (Imhof, Biometrika, 1961)."""
    variances = np.array(std) ** 2
    square = float(distance_quantile(variances[None])[0]) ** 2
    u = np.arange(0.5, 800_000) * 5e-4
    phase = 0.5 * np.arctan(np.outer(variances, u)).sum(axis=0) - 0.5 * square * u
    size = u * np.prod((1 + np.outer(variances, u) ** 2) ** 0.25, axis=0)
    assert 0.5 - (np.sin(phase) / size).sum() * 5e-4 / np.pi == pytest.approx(0.95, abs=3e-6)


def test_against_drawn_vectors(rng: np.random.Generator) -> None:
    root = rng.standard_normal((3, 3)) * np.array([1.0, 0.4, 0.1])
    drawn = np.linalg.norm(rng.standard_normal((1_000_000, 3)) @ root.T, axis=1)
    variances = principal_variances((root @ root.T)[None])
    assert distance_quantile(variances)[0] == pytest.approx(np.quantile(drawn, 0.95), rel=3e-3)
    assert mean_distance(variances)[0] == pytest.approx(drawn.mean(), rel=3e-3)
    assert distance_probability(np.array([np.median(drawn)]), variances)[0] == pytest.approx(0.5, abs=2e-3)


def test_the_series_is_right_between_its_nodes(rng: np.random.Generator) -> None:
    std = np.sort(rng.uniform(size=(500, 3)), axis=1)[:, ::-1] * np.array([1.0, 0.7, 0.5])
    variances = np.sort(std**2, axis=1)[:, ::-1]
    assert np.abs(distance_probability(distance_quantile(variances), variances) - 0.95).max() < 2e-6


def test_mean_distances_against_scipys_elliptic_integral(rng: np.random.Generator) -> None:
    variances = np.vstack([10 ** rng.uniform(-14, 2, (5000, 3)), [[1, 0, 0], [1, 1, 0], [1, 1e-6, 0]]])
    expected = np.sqrt(8 / np.pi) * elliprg(*variances.T)
    assert mean_distance(variances) == pytest.approx(expected, rel=1e-13)


def test_what_is_no_number_is_no_distance_and_costs_the_others_nothing() -> None:
    found = mean_distance(np.array([[np.nan, 1.0, 1.0], [4.0, 0.0, 0.0]]))
    assert np.isnan(found[0]) and found[1] == pytest.approx(2 * chi(1).mean(), rel=1e-12)


def test_no_error_at_all_is_no_distance() -> None:
    assert distance_quantile(np.zeros((1, 3)))[0] == 0 and mean_distance(np.zeros((1, 3)))[0] == 0


def test_estimated_variances_have_longer_tails(rng: np.random.Generator) -> None:
    """Vectors whose common variance was estimated with 8 degrees of freedom, against drawn ones."""
    std, freedom = np.array([2.0, 1.0, 0.4]), 8
    estimated = rng.chisquare(freedom, 200_000) / freedom
    length = np.linalg.norm(std * rng.standard_normal((200_000, 3)), axis=1) / np.sqrt(estimated)
    for share in (0.5, 0.95):
        at = np.quantile(length, share)
        below = distance_probability(np.array([at]), std[None] ** 2, freedom)[0]
        assert below == pytest.approx(share, abs=0.004)
    assert distance_probability(np.array([3.0]), std[None] ** 2, np.inf)[0] == pytest.approx(
        distance_probability(np.array([3.0]), std[None] ** 2)[0], abs=1e-12
    )
