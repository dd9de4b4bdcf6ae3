"""Multisines: orthogonality, the time signal against its definition, detection lines, crest factor, reference."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from flexcal.frequency.periodic import (
    crest_factor,
    excitation_torque,
    half_integer_frequency,
    leave_out_detection_lines,
    multisine,
    multisine_spectra,
    odd_lines,
    orthogonal_matrix,
    reference_trajectory,
)


def off_diagonal(matrices):
    n = matrices.shape[-1]
    return np.abs(matrices * (1.0 - np.eye(n))).max()


def dagger(matrices):
    return np.swapaxes(matrices, -1, -2).conj()


@given(st.integers(1, 12))
def test_orthogonal_matrix_is_unitary_for_any_number_of_inputs(n_u):
    t = orthogonal_matrix(n_u)
    np.testing.assert_allclose(t @ t.conj().T, np.eye(n_u), atol=1e-14)
    np.testing.assert_allclose(np.abs(t), n_u**-0.5, rtol=1e-14)


@pytest.mark.parametrize("joints", [(0,), (0, 2), (0, 1, 2)])
def test_rows_are_always_orthogonal_columns_only_for_equal_amplitudes(make_plan, joints):
    unequal, lines = make_plan(joints=joints), make_plan().lines
    equal = make_plan(joints=joints, amplitude=np.full((len(joints), lines.size), 2.0))
    for plan in (unequal, equal):
        gamma = multisine_spectra(plan, 1)
        np.testing.assert_allclose(np.einsum("lij,lij->li", gamma, gamma.conj()).real, plan.amplitude.T**2)
        assert off_diagonal(gamma @ dagger(gamma)) < 1e-12
    assert off_diagonal(dagger(multisine_spectra(equal, 1)) @ multisine_spectra(equal, 1)) < 1e-12
    if len(joints) > 1:
        assert off_diagonal(dagger(multisine_spectra(unequal, 1)) @ multisine_spectra(unequal, 1)) > 0.1


def test_phases_are_a_function_of_seed_and_realisation(make_plan):
    plan = make_plan()
    np.testing.assert_array_equal(multisine_spectra(plan, 2), multisine_spectra(make_plan(), 2))
    assert np.abs(multisine_spectra(plan, 2) - multisine_spectra(plan, 1)).max() > 0.5
    assert np.abs(multisine_spectra(plan, 2) - multisine_spectra(make_plan(seed=6), 2)).max() > 0.5
    many = np.concatenate([multisine.random_phases(plan, r).ravel() for r in range(50)])
    assert abs(np.exp(1j * many).mean()) < 3.0 / np.sqrt(many.size)


def test_time_signal_is_the_sum_of_cosines(make_plan):
    plan = make_plan()
    t = np.arange(round(plan.rate_hz / plan.base_frequency_hz)) / plan.rate_hz
    gamma = multisine_spectra(plan, 0)[:, :, 1]
    angle = 2 * np.pi * plan.base_frequency_hz * plan.lines[:, None, None] * t[:, None]
    direct = (np.abs(gamma)[:, None] * np.cos(angle + np.angle(gamma)[:, None])).sum(0)
    np.testing.assert_allclose(excitation_torque(plan, 0, 1), direct, atol=1e-11)
    np.testing.assert_allclose(excitation_torque(plan, 0, 1, sign=-1), -direct, atol=1e-11)


def test_detection_lines_stay_empty_in_all_experiments(make_plan):
    whole = make_plan()
    plan = leave_out_detection_lines(whole)
    every, lines, detection = whole.lines, plan.lines, plan.detection_lines
    np.testing.assert_array_equal(np.sort(np.concatenate([lines, detection])), every)
    assert detection.size == every.size // 4 and set(np.diff(np.searchsorted(every, detection) // 4)) == {1}
    np.testing.assert_allclose((plan.amplitude**2).sum(1), (whole.amplitude**2).sum(1))
    other = leave_out_detection_lines(replace(whole, seed=9))
    assert not np.array_equal(other.detection_lines, detection)
    np.testing.assert_array_equal(leave_out_detection_lines(whole).detection_lines, detection)
    for experiment in range(2):
        spectrum = np.abs(np.fft.rfft(excitation_torque(plan, 0, experiment), axis=0))
        assert spectrum[detection].max() < 1e-9
        assert np.delete(spectrum, lines, axis=0).max() < 1e-9 and spectrum[lines].min() > 1.0


def test_odd_lines_lie_in_the_band():
    lines = odd_lines(0.25, 3.0, 80.0)
    assert (lines % 2 == 1).all() and lines[0] == 13 and lines[-1] == 319
    with refused("E-FRF-020"):
        odd_lines(1.0, 3.2, 4.1)


def test_crest_factor_falls_jointly_over_the_experiments(make_plan):
    plan = make_plan(joints=(0, 1, 2), rate_hz=1000.0)
    lower = replace(plan, crest="optimised")
    before = np.stack([excitation_torque(plan, 0, e) for e in range(3)])
    after = np.stack([excitation_torque(lower, 0, e) for e in range(3)])
    assert np.max([crest_factor(one) for one in before]) > 2.8
    assert np.max([crest_factor(one) for one in after]) < 2.1
    np.testing.assert_allclose(np.square(after).mean(1), np.square(before).mean(1), rtol=1e-10)
    gamma = multisine_spectra(lower, 0)
    assert off_diagonal(gamma @ dagger(gamma)) < 1e-12
    assert np.abs(multisine_spectra(lower, 1) - gamma).max() > 0.5  # the realisations stay different


def test_reference_derivatives_and_half_integer_frequency(make_plan):
    assert half_integer_frequency(0.25, 2.2) == 2.125
    assert half_integer_frequency(0.25, 0.0) == 0.125
    plan = make_plan(reference_amplitude=0.03)
    assert (plan.reference_frequency_hz / plan.base_frequency_hz) % 1.0 == 0.5
    t, h = np.linspace(0.0, 2.0, 41), 1e-5
    angle, velocity, acceleration = reference_trajectory(plan, t)
    np.testing.assert_allclose(angle[0], 0.0)
    assert np.abs(angle).max() <= 0.03
    np.testing.assert_allclose(
        (reference_trajectory(plan, t + h)[0] - reference_trajectory(plan, t - h)[0]) / (2 * h),
        velocity,
        atol=1e-8,
    )
    np.testing.assert_allclose(
        (reference_trajectory(plan, t + h)[1] - reference_trajectory(plan, t - h)[1]) / (2 * h),
        acceleration,
        atol=1e-6,
    )


def test_a_period_must_be_whole_samples(make_plan):
    with refused("E-FRF-022"):
        excitation_torque(make_plan(rate_hz=333.3), 0, 0)
