"""The local polynomial method where (20) does not apply: a start from rest, one record for two inputs."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from refusals import refused

from flexcal.data.recordings import Recording, RecordingLabel
from flexcal.frequency.periodic import (
    excitation_torque,
    kronecker,
    local_polynomial_responses,
    odd_lines,
    pose_response,
)
from flexcal.frequency.periodic.local_polynomial import local_polynomial, without_transient


def from_rest(mechanism, plan, experiments, rng, noise):
    """Records of the whole plan, settle periods and all, by stepping the held plant from rest: the transient is in them."""
    step, n = 1.0 / plan.rate_hz, 2
    size = mechanism.mass.shape[0]
    inverse = np.linalg.inv(mechanism.mass)
    a = np.block(
        [
            [np.zeros((size, size)), np.eye(size)],
            [-inverse @ mechanism.stiffness, -inverse @ mechanism.damping],
        ]
    )
    b = np.vstack([np.zeros((size, n)), inverse[:, :n]])
    block = scipy.linalg.expm(np.block([[a, b], [np.zeros((n, 2 * size + n))]]) * step)
    ad, bd = block[: 2 * size, : 2 * size], block[: 2 * size, 2 * size :]
    for experiment in experiments:
        u = np.tile(excitation_torque(plan, 0, experiment), (plan.periods, 1))
        q, torque = np.zeros((len(u), 3)), np.zeros((len(u), 3))
        state = np.zeros(2 * size)
        for i, row in enumerate(u):
            q[i, [0, 2]] = state[:n]
            state = ad @ state + bd @ row
        torque[:, [0, 2]] = u
        q[:, [0, 2]] += noise * rng.standard_normal((len(u), n))
        yield Recording(time_step=step, q=q, torque=torque, label=RecordingLabel(0, 0, experiment, 1))


def test_transient_is_removed_and_the_covariance_holds(make_plan, mechanism):
    """Two experiments from rest: E|δ|²/σ² = 1 where noise is all there is, less where a parabola does not follow a resonance."""
    plan = make_plan(
        base_frequency_hz=0.125,
        lines=odd_lines(0.125, 4.0, 30.0),
        periods=2,
        settle_periods=0,
        realisations=1,
        signs=False,
        rate_hz=400.0,
    )
    ratios, errors = [], []
    for seed in range(6):
        recordings = list(from_rest(mechanism, plan, (0, 1), np.random.default_rng(seed), 2e-6))
        (found,) = local_polynomial_responses(plan, recordings)
        true = mechanism.acceleration_response(2 * np.pi * plan.frequencies_hz)
        delta = found.response - true
        ratios.append(np.abs(delta) ** 2 / found.std**2)
        errors.append(np.linalg.norm(delta, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2)))
    assert found.degrees_of_freedom == 2 * 7 - 3 * 2
    assert np.median(errors) < 0.02
    resonant = np.median(np.array(ratios)[:, plan.frequencies_hz < 18.0]) / np.log(2.0)
    smooth = np.median(np.array(ratios)[:, plan.frequencies_hz >= 18.0]) / np.log(2.0)
    assert 0.85 < smooth < 1.25 and 0.1 < resonant < 1.25


def test_one_record_of_two_inputs(mechanism, rng):
    """Random torque on both axes at once, one long record: both columns of G come out, and the covariance is right."""
    samples, step = 32_000, 1.0 / 400.0
    bins = np.arange(240, 3200)
    u = rng.standard_normal((bins.size, 2)) + 1j * rng.standard_normal((bins.size, 2))
    true = mechanism.acceleration_response(2 * np.pi * bins / (samples * step))
    noise = 0.02 * (rng.standard_normal((bins.size, 2)) + 1j * rng.standard_normal((bins.size, 2)))
    found = local_polynomial(u[None], (np.einsum("lij,lj->li", true, u) + noise)[None], 41)
    freedom = found.degrees_of_freedom
    assert freedom == 41 - 6
    delta = np.swapaxes(found.response - true, 1, 2).reshape(len(true), -1)
    solved = np.linalg.solve(kronecker(found.gain, found.scatter), delta[..., None])[..., 0]
    distance = np.einsum("li,li->l", delta.conj(), solved).real / 4
    assert 0.8 < distance.mean() * (freedom - 2) / freedom < 1.25


def test_polynomial_plant_is_exact(rng):
    k = np.arange(60)
    u = rng.standard_normal((2, 60, 2)) + 1j * rng.standard_normal((2, 60, 2))
    g = rng.standard_normal((3, 2, 2)) + 1j * rng.standard_normal((3, 2, 2))
    plant = g[0] + g[1] * (k / 60)[:, None, None] + g[2] * ((k / 60) ** 2)[:, None, None]
    found = local_polynomial(u, np.einsum("kij,ekj->eki", plant, u), 9)
    np.testing.assert_allclose(found.response, plant, atol=1e-11)
    assert np.abs(found.scatter).max() < 1e-20


def test_polynomial_transient_is_exact_and_noise_is_measured(rng):
    """What is left at a line is its own value; the noise that is said to be there is that of line and transient together."""
    k, lines = np.arange(400), np.arange(6, 400, 8)
    quiet = np.setdiff1d(k, lines)
    transient = rng.standard_normal((5, 1, 3)) * (k / 400)[None, :, None] ** 2 * (1 + 2j) + 0.3
    signal = np.zeros((5, 400, 3), complex)
    signal[:, lines] = rng.standard_normal((5, len(lines), 3))
    found, noise = without_transient(signal + transient, lines, quiet)
    np.testing.assert_allclose(found, signal[:, lines], atol=1e-12)
    assert np.abs(noise).max() < 1e-24
    size = np.array([0.1, 0.2, 0.4])
    white = size * (rng.standard_normal((200, 400, 3)) + 1j * rng.standard_normal((200, 400, 3))) / np.sqrt(2)
    left, noise = without_transient(white, lines, quiet)
    said = np.diagonal(noise, axis1=1, axis2=2).real
    np.testing.assert_allclose(np.mean(np.abs(left) ** 2, axis=0).mean(0), said.mean(0), rtol=0.05)
    assert said.mean(0) == pytest.approx(1.2 * size**2, rel=0.15)


def test_too_little_excitation_is_said(rng):
    u = np.ones((1, 60, 2)) + 0j
    y = np.ones((1, 60, 2)) + 0j
    with refused("E-FRF-016"):
        local_polynomial(u, y, 11)
    with refused("E-FRF-014", "6"):
        local_polynomial(u, y, 7)
    with refused("E-FRF-015"):
        local_polynomial(u * np.array([1.0, 0.0]), y, 11)
    with refused("E-FRF-017", "11"):
        without_transient(u, np.arange(49), np.arange(49, 60))


def test_it_agrees_with_averaging_in_the_steady_state(make_plan, linear_cell, mechanism, rng):
    """Four realisations with a reference and both signs: each within its own uncertainty of the truth, pooled over the lines."""
    plan = make_plan(reference_amplitude=0.05, periods=4)
    recordings = list(linear_cell(position_noise=2e-7, torque_noise=1e-3).record(plan, rng))
    (local,) = local_polynomial_responses(plan, recordings, joint_names=("a", "b"))
    averaged = pose_response(plan, 0, recordings)
    true = mechanism.acceleration_response(local.omega)
    sharp = np.abs(local.response - true).max((1, 2)) / np.abs(true).max((1, 2))
    assert np.median(sharp) < 0.01
    np.testing.assert_allclose(local.q_mean, averaged.q_mean, atol=1e-9)
    assert local.joints == ("a", "b") and local.average == "local_polynomial"
    assert local.degrees_of_freedom >= 8 * 3 - 6 - 8


def test_a_reference_needs_both_signs(make_plan, linear_cell, rng):
    plan = make_plan(signs=False, reference_amplitude=0.05)
    with refused("E-FRF-018"):
        list(local_polynomial_responses(plan, linear_cell().record(plan, rng)))


def test_records_must_be_there_and_whole(make_plan, linear_cell, rng):
    plan = make_plan()
    good = list(linear_cell().record(plan, rng))
    cut = replace(good[0], q=good[0].q[:-7], torque=good[0].torque[:-7])
    with refused("E-FRF-010", "1593", "1600"):
        list(local_polynomial_responses(plan, [cut, *good[1:]]))
    with refused("E-FRF-024", "pose_1_realisation_1_experiment_1_plus"):
        list(local_polynomial_responses(plan, good[1:]))
