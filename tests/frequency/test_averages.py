"""The averages agree without noise; in closed loop with noise the logarithmic one is less biased than H1."""

from typing import get_args

import numpy as np
import pytest

from flexcal.frequency.periodic import Average, averages, pose_response


def complex_normal(rng, *shape):
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)


@pytest.mark.parametrize("average", get_args(Average))
def test_all_averages_agree_without_noise(make_plan, linear_cell, rng, average):
    plan = make_plan()
    recordings = list(linear_cell(feedback=500.0).record(plan, rng))
    expected = pose_response(plan, 0, recordings).response
    found = pose_response(plan, 0, recordings, average).response
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_logarithmic_average_of_one_axis_is_the_mean_logarithm(rng):
    values = 2.0 + 0.3 * complex_normal(rng, 5, 7, 1, 1)
    np.testing.assert_allclose(averages.logarithmic(values), np.exp(np.log(values).mean(0)), rtol=1e-12)


def test_logarithmic_average_does_not_depend_on_the_basis(rng):
    values = complex_normal(rng, 3, 3) + 0.2 * complex_normal(rng, 4, 6, 3, 3)
    a, b = complex_normal(rng, 3, 3), complex_normal(rng, 3, 3)
    np.testing.assert_allclose(
        averages.logarithmic(a @ values @ b), a @ averages.logarithmic(values) @ b, atol=1e-9
    )


def test_logarithm_series_and_eigenvectors_meet(rng):
    direction = complex_normal(rng, 50, 3, 3)
    direction /= np.linalg.norm(direction, axis=(1, 2), keepdims=True)
    for size in (0.0999999, 0.1000001):
        matrix = np.eye(3) + size * direction
        logarithm = averages._matrix_logarithm(matrix)
        np.testing.assert_allclose(averages._matrix_function(logarithm, np.exp), matrix, atol=1e-12)


def test_harmonic_is_the_inverse_of_the_mean_inverse(rng):
    values = np.eye(2) + 0.2 * complex_normal(rng, 4, 6, 2, 2)
    np.testing.assert_allclose(
        averages.harmonic(values), np.linalg.inv(np.linalg.inv(values).mean(0)), rtol=1e-12
    )


def closed_loop_bias(make_plan, linear_cell, seeds):
    """Mean relative error over seeds of the diagonal, per average, where feedback carries sensor noise into the torque."""
    plan = make_plan(lines=2 * np.arange(4, 40) + 1)
    exact = pose_response(plan, 0, linear_cell().record(plan, np.random.default_rng(0))).response
    errors = {average: [] for average in get_args(Average)}
    for seed in range(seeds):
        recordings = list(
            linear_cell(feedback=2e4, position_noise=1e-4).record(plan, np.random.default_rng(seed))
        )
        for average in errors:
            found = pose_response(plan, 0, recordings, average).response
            errors[average].append(np.einsum("lii->li", found / exact - 1.0))
    return {average: np.abs(np.mean(values, 0)).mean() for average, values in errors.items()}


def test_logarithmic_average_is_less_biased_than_h1_in_closed_loop(make_plan, linear_cell):
    bias = closed_loop_bias(make_plan, linear_cell, 60)
    assert bias["logarithmic"] < 0.5 * bias["h1"]
    assert bias["joint_input_output"] < 0.5 * bias["h1"]
    assert bias["errors_in_variables"] < 0.5 * bias["h1"]
