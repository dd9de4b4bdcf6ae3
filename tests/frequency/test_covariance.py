"""Reported covariances against the scatter of repeated experiments, and the algebra behind them."""

import numpy as np
import pytest
from over_seeds import over_seeds

from flexcal.frequency.periodic import kronecker, pool_noise, pose_response
from flexcal.frequency.periodic.covariance import (
    input_gain,
    output_noise,
)
from flexcal.kernels import scatter_covariance

NOISES = {
    "encoder": {"position_noise": 2e-5},
    "process": {"process_noise": 0.5},
    "torque": {"torque_noise": 0.1},
    "closed loop": {"position_noise": 1e-5, "process_noise": 0.2, "torque_noise": 0.1, "feedback": 500.0},
}


def complex_normal(rng, *shape):
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("signs", [True, False])
def test_error_of_the_mean_is_what_the_covariance_says(make_plan, linear_cell, noise, signs):
    """16 seeds × 75 lines × 4 elements: E|δ|²/σ² = 1, 95 % regions hold the truth, the noise explains it all."""
    plan = make_plan(signs=signs, reference_amplitude=0.02)
    exact = pose_response(plan, 0, linear_cell().record(plan, np.random.default_rng(0)))
    ratios, noise_ratios, distances = [], [], []
    for seed in range(16):
        found = pose_response(plan, 0, linear_cell(**NOISES[noise]).record(plan, np.random.default_rng(seed)))
        error = np.abs(found.response - exact.response) ** 2
        ratios.append(error / found.std**2)
        noise_ratios.append(error / found.noise_std**2)
        delta = found.vec - exact.vec
        distances.append(
            np.einsum("li,li->l", delta.conj(), np.linalg.solve(found.covariance, delta[..., None])[..., 0])
        )
    assert 0.85 < np.mean(ratios) < 1.25
    assert 0.85 < np.mean(noise_ratios) < 1.25
    assert 0.85 < np.real(np.mean(distances)) / 4 < 1.3
    inside = np.mean(np.array(ratios) < -np.log(0.05))  # |δ|²/σ² of a complex normal number is exponential
    assert 0.92 < inside < 0.975


def squares_over_variances(seed, plan, linear_cell, exact):
    found = pose_response(plan, 0, linear_cell(position_noise=2e-5).record(plan, np.random.default_rng(seed)))
    return np.abs(found.response - exact) ** 2 / found.std**2


@pytest.mark.slow
def test_every_line_is_covered(make_plan, linear_cell):
    """200 seeds: line by line and element by element, poles and zeros included, E|δ|²/σ² is near 1."""
    plan = make_plan()
    exact = pose_response(plan, 0, linear_cell().record(plan, np.random.default_rng(0))).response
    ratios = over_seeds(squares_over_variances, range(200), plan, linear_cell, exact)
    mean = np.mean(ratios, axis=0)
    print(f"{mean.min():.3f} to {mean.max():.3f}")
    assert mean.min() > 0.7 and mean.max() < 1.4


def test_propagation_through_the_division(rng):
    """conj((ΓΓᴴ)⁻¹) ⊗ cov(N_y - G N_u) against the scatter of (Y + N_y)(Γ + N_u)⁻¹."""
    n, draws = 3, 40_000
    gamma, g = complex_normal(rng, n, n), complex_normal(rng, n, n)
    root = 1e-3 * complex_normal(rng, 2 * n, 2 * n)
    noise = root @ complex_normal(rng, draws, 2 * n, n)
    found = (g @ gamma + noise[:, :n]) @ np.linalg.inv(gamma + noise[:, n:])
    errors = np.swapaxes(found - g, 1, 2).reshape(draws, -1)
    sample = errors.T @ errors.conj() / draws
    predicted = kronecker(
        input_gain(np.linalg.inv(gamma)[None, None]), output_noise(g[None], (root @ root.conj().T)[None])
    )[0]
    size = np.sqrt(np.outer(np.diag(predicted), np.diag(predicted)).real)
    np.testing.assert_allclose(sample / size, predicted / size, atol=0.04)


def test_pool_is_a_moving_mean_of_constant_width(rng):
    values, bins = rng.standard_normal((20, 2)), np.arange(20) * 2
    pooled = pool_noise(values, bins, np.array([0, 20, 38]), 5)
    np.testing.assert_allclose(pooled, [values[:5].mean(0), values[8:13].mean(0), values[-5:].mean(0)])
    np.testing.assert_allclose(pool_noise(values, bins, np.array([7]), 50), [values.mean(0)])


def pooled(white, right, left, count, freedom):
    """The kernel's covariance (L, n m, n m) of scatter (L, m, R, n)."""
    lines, m, _, n = white.shape
    out = np.empty((lines, n * m, n * m), complex)
    parts = [
        np.ascontiguousarray(values).view(float).reshape(*values.shape, 2) for values in (white, right, left)
    ]
    scatter_covariance(*parts, count, freedom, out.view(float).reshape(*out.shape, 2))
    return out


@pytest.mark.parametrize(
    ("lines", "m", "n", "members", "count"),
    [(37, 3, 3, 4, 15), (9, 4, 2, 3, 9), (2, 1, 1, 2, 1), (6, 2, 3, 1, 2)],
)
def test_pooled_scatter_is_shrunk_and_carried_back(rng, lines, m, n, members, count):
    """Against windows, shrinkage and Kronecker products as one writes them; sensors make m larger than n."""
    white = complex_normal(rng, lines, m, members, n)
    right, left = (np.tril(complex_normal(rng, lines, size, size)) for size in (n, m))
    freedom = 0.7 * members * count
    found = pooled(white, right, left, count, freedom)
    for k in range(lines):
        first = min(max(k - count // 2, 0), lines - count)
        vectors = white[first : first + count].transpose(0, 2, 3, 1).reshape(-1, n * m)
        sample = vectors.T @ vectors.conj() / len(vectors)
        variance = np.diag(np.diag(sample).real)
        chance = (np.trace(variance) ** 2 - np.sum(variance**2)) / freedom
        power = np.sum(np.abs(sample - variance) ** 2)
        kept = 1.0 - chance / power if power > chance else 0.0
        shrunk = variance + kept * (sample - variance) + 1e-12 * np.eye(n * m)
        factor = np.kron(right[k], left[k])
        expected = factor @ shrunk @ factor.conj().T
        np.testing.assert_allclose(found[k], expected, rtol=1e-12, atol=1e-13 * np.abs(expected).max())
        np.testing.assert_array_equal(found[k], found[k].conj().T)


def test_kronecker_product_of_every_line(rng):
    right, left = complex_normal(rng, 4, 3, 3), complex_normal(rng, 4, 2, 2)
    expected = np.stack([np.kron(a, b) for a, b in zip(right, left, strict=True)])
    np.testing.assert_allclose(kronecker(right, left), expected)


def test_shrinkage_drops_chance_and_keeps_correlation(rng):
    freedom, p = 45, 9
    one = np.ones((200, 1, 1), complex), np.tile(np.eye(p, dtype=complex), (200, 1, 1))
    independent = complex_normal(rng, 200, p, freedom)
    sample = independent @ np.swapaxes(independent, 1, 2).conj() / freedom
    shrunk = pooled(independent[..., None], *one, 1, freedom)
    off = ~np.eye(p, dtype=bool)
    assert np.abs(shrunk[:, off]).mean() < 0.3 * np.abs(sample[:, off]).mean()
    assert np.linalg.cond(shrunk).mean() < 0.5 * np.linalg.cond(sample).mean()
    common = independent + 2.0 * complex_normal(rng, 200, 1, freedom)
    sample = common @ np.swapaxes(common, 1, 2).conj() / freedom
    shrunk = pooled(common[..., None], *one, 1, freedom)
    assert np.abs(shrunk[:, off]).mean() > 0.95 * np.abs(sample[:, off]).mean()
