"""The local polynomial method where (20) does not apply: a start from rest, one record for two inputs."""

import numpy as np
import pytest
import scipy.linalg

from flexcal.data import Recording
from flexcal.errors import FlexcalError
from flexcal.frequency import local_polynomial, local_polynomial_response, multisine


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
        u = np.tile(multisine.torque(plan, 0, experiment), (plan.periods, 1))
        q, torque = np.zeros((len(u), 3)), np.zeros((len(u), 3))
        state = np.zeros(2 * size)
        for i, row in enumerate(u):
            q[i, [0, 2]] = state[:n]
            state = ad @ state + bd @ row
        torque[:, [0, 2]] = u
        q[:, [0, 2]] += noise * rng.standard_normal((len(u), n))
        yield Recording(time_step=step, q=q, torque=torque)


def test_transient_is_removed_and_the_covariance_holds(make_plan, mechanism):
    """Two experiments from rest with the torque instantaneous in the fit's eyes corrected for the hold: E|δ|²/σ² = 1."""
    plan = make_plan(
        base_frequency_hz=0.125,
        lines=multisine.odd_lines(0.125, 4.0, 30.0),
        periods=2,
        settle_periods=0,
        rate_hz=400.0,
    )
    ratios, errors = [], []
    for seed in range(6):
        recordings = list(from_rest(mechanism, plan, (0, 1), np.random.default_rng(seed), 2e-6))
        found, covariance, freedom = local_polynomial_response(plan, recordings, half_width=14)
        true = mechanism.acceleration_response(2 * np.pi * plan.frequencies_hz)
        delta = np.swapaxes(found - true, 1, 2).reshape(len(true), -1)
        ratios.append(np.abs(delta) ** 2 / np.diagonal(covariance, axis1=1, axis2=2).real)
        errors.append(np.linalg.norm(found - true, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2)))
    assert freedom == 2 * 29 - 3 * 4
    assert np.median(errors) < 0.02
    assert 0.7 < np.median(ratios) / np.log(2.0) < 1.5


def test_one_record_of_two_inputs(make_plan, mechanism, rng):
    """Random torque on both axes at once, one long record: both columns of G come out."""
    plan = make_plan(periods=40, settle_periods=0, realisations=40, rate_hz=400.0, base_frequency_hz=0.5)
    n, samples, step = 2, 32_000, 1.0 / 400.0
    bins = np.arange(1, samples // 2)
    u = np.fft.rfft(rng.standard_normal((samples, n)), axis=0)[bins]
    omega = 2 * np.pi * bins / (samples * step)
    true = mechanism.acceleration_response(omega)
    noise = (
        0.02
        * (rng.standard_normal((bins.size, n)) + 1j * rng.standard_normal((bins.size, n)))
        * np.abs(u).mean()
    )
    y = np.einsum("lij,lj->li", true, u) + noise
    at = np.rint(plan.frequencies_hz * samples * step).astype(int) - 1
    found, covariance, freedom = local_polynomial(u[None], y[None], at, half_width=20)
    assert freedom == 41 - 9
    delta = np.swapaxes(found - true[at], 1, 2).reshape(len(at), -1)
    distance = (
        np.einsum("li,li->l", delta.conj(), np.linalg.solve(covariance, delta[..., None])[..., 0]).real / 4
    )
    assert 0.8 < distance.mean() * (freedom - n) / freedom < 1.25


def test_polynomial_plant_and_transient_are_exact(rng):
    k = np.arange(60)
    u = rng.standard_normal((2, 60, 2)) + 1j * rng.standard_normal((2, 60, 2))
    g = rng.standard_normal((3, 2, 2)) + 1j * rng.standard_normal((3, 2, 2))
    plant = g[0] + g[1] * (k / 60)[:, None, None] + g[2] * ((k / 60) ** 2)[:, None, None]
    transient = (rng.standard_normal((2, 1, 2)) * (k / 60)[None, :, None] ** 2) * (1 + 2j)
    y = np.einsum("kij,ekj->eki", plant, u) + transient
    at = np.array([0, 7, 30, 59])
    found, covariance, _ = local_polynomial(u, y, at, half_width=8)
    np.testing.assert_allclose(found, plant[at], atol=1e-11)
    assert np.abs(covariance).max() < 1e-20


def test_too_little_excitation_is_said(rng):
    u = np.ones((1, 60, 2)) + 0j
    y = np.ones((1, 60, 2)) + 0j
    with pytest.raises(FlexcalError, match="does not tell the inputs apart"):
        local_polynomial(u, y, np.array([30]), half_width=10)
    with pytest.raises(FlexcalError, match="cannot determine 9 unknowns"):
        local_polynomial(u, y, np.array([30]), half_width=4)
    with pytest.raises(FlexcalError, match="no power"):
        local_polynomial(u * np.array([1.0, 0.0]), y, np.array([30]), half_width=10)


def test_records_must_be_alike_and_whole(make_plan, linear_cell, rng):
    plan = make_plan()
    good = list(linear_cell().record(plan, rng))[:2]
    cut = Recording(time_step=good[0].time_step, q=good[0].q[:-7], torque=good[0].torque[:-7])
    with pytest.raises(FlexcalError, match="one length"):
        local_polynomial_response(plan, [good[0], cut], half_width=20)
    with pytest.raises(FlexcalError, match="whole number of periods"):
        local_polynomial_response(plan, [cut], half_width=20)
