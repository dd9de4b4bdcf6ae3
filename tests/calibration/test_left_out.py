"""Errors at left-out poses from the hat matrix, against fits that really leave them out."""

from __future__ import annotations

import numpy as np
import pytest

from flexcal.calibration.error_model import order_folds, repeated_pose_numbers
from flexcal.calibration.term_selection.leave_out_errors import LinearBasis


@pytest.mark.parametrize("folds", [40, 8, 3])
def test_left_out_errors_are_those_of_fits_without_the_fold(folds: int, rng: np.random.Generator) -> None:
    """Blocks of a few points and blocks with more rows than columns, with a prior on one block of columns."""
    free, held = rng.standard_normal((40, 3, 9)), rng.standard_normal((40, 3, 4))
    residuals = 1e-4 * rng.standard_normal((40, 3))
    fold, penalty = order_folds(40, folds), 2.5
    basis = LinearBasis.of(residuals).extended(held, penalty).extended(free, 0.0)
    found = basis.left_out([fold]).distances[0]
    both = np.concatenate([free, held], axis=2)
    for k in range(folds):
        inside = both[fold != k].reshape(-1, 13)
        information = inside.T @ inside + np.diag([0.0] * 9 + [penalty] * 4)
        solution = np.linalg.solve(information, inside.T @ residuals[fold != k].ravel())
        expected = np.linalg.norm(residuals[fold == k] - both[fold == k] @ solution, axis=1)
        np.testing.assert_allclose(found[fold == k], expected, rtol=1e-4)


def test_what_the_fit_leaves_is_that_of_least_squares(rng: np.random.Generator) -> None:
    columns, residuals = rng.standard_normal((50, 3, 6)), 1e-4 * rng.standard_normal((50, 3))
    left = np.linalg.lstsq(columns.reshape(150, 6), residuals.ravel(), rcond=None)[1]
    found = LinearBasis.of(residuals).extended(columns, 0.0).left_out([])
    assert found.squares == pytest.approx(left[0], rel=1e-5)
    assert found.freedom == pytest.approx(6, abs=1e-3)


def test_a_column_that_one_pose_alone_sees_is_held_there(rng: np.random.Generator) -> None:
    """Without that pose nothing is known of it: the prediction stays where it was, and nothing blows up."""
    columns, residuals = rng.standard_normal((30, 3, 4)), 1e-4 * rng.standard_normal((30, 3))
    columns[1:, :, 3] = 0.0
    found = LinearBasis.of(residuals).extended(columns, 0.0).left_out([np.arange(30)]).distances[0]
    assert found[0] < 1e-3


def test_poses_that_repeat_are_one() -> None:
    q = np.array([[0.0, 1.0], [0.001, 0.999], [0.5, 1.0], [0.0, 1.0]])
    number = repeated_pose_numbers(q)
    assert number[0] == number[1] == number[3] != number[2]


def test_expected_errors_are_the_mean_of_many_draws(rng: np.random.Generator) -> None:
    """Points of 0.1 mm beside lengths of 0.5 mm, which have one coordinate, and columns with a prior; 800 draws tell each to 3 %."""
    free, held = rng.standard_normal((60, 3, 9)), 1e-4 * rng.standard_normal((60, 3, 3))
    std = np.full((60, 3), 1e-4)
    std[20:] = (5e-4, 0.0, 0.0)
    free[20:, 1:] = held[20:, 1:] = 0.0
    folds, penalty = [order_folds(60, 60), order_folds(60, 8)], 2e-8
    left, fitted = [], []
    for _ in range(800):
        errors = std * rng.standard_normal((60, 3)) + held @ rng.standard_normal(3)
        basis = LinearBasis.of(errors).extended(held, penalty).extended(free, 0.0)
        found = basis.left_out(folds)
        left.append(found.distances)
        fitted.append(found.fitted)
    each = [basis.left_out([fold], variances=std**2) for fold in folds]
    expected = [found.expected for found in each]
    assert np.mean(left, axis=0) / expected == pytest.approx(np.ones((2, 60)), abs=0.12)
    assert (np.mean(left, axis=0) / expected).mean() == pytest.approx(1, abs=0.01)
    assert (np.mean(fitted, axis=0) / each[0].expected_fitted).mean() == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("lacking", [False, True])
def test_a_model_error_shows_in_folds_beyond_what_scatter_explains(
    rng: np.random.Generator, lacking: bool
) -> None:
    """Polynomials of degree 5 fitted to noise alone, and to a wave of three periods of the same size."""
    t = np.linspace(-1, 1, 80)
    powers = np.polynomial.legendre.legvander(t, 5)
    columns = (powers[:, None, :, None] * np.eye(3)[:, None, :]).reshape(80, 3, 18)
    size = np.full((80, 3), 1e-4)
    wave = 1.41 * size * np.sin(3 * np.pi * t)[:, None]
    errors = wave if lacking else size * rng.standard_normal((80, 3))
    basis = LinearBasis.of(errors).extended(columns, 0.0)
    found = basis.left_out([order_folds(80, 8)], variances=size**2)
    growth = found.expected.mean() / found.expected_fitted.mean()
    ratio = found.distances[0].mean() / (growth * found.fitted.mean())
    assert (ratio > 1.35) == lacking
