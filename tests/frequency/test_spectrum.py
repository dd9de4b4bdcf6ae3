"""Spectra at chosen bins, the bins taken for noise, and the hold factors against integrals."""

import numpy as np
from refusals import refused

from flexcal.frequency.periodic import noise_lines, spectrum, torque_hold
from flexcal.frequency.periodic.line_spectra import noise_in_half_sum


def test_spectrum_finds_phasors_on_whole_and_half_lines(rng):
    samples, periods = 300, 2
    t = np.arange(samples * periods) / samples
    phasors = rng.standard_normal((3, 2)) + 1j * rng.standard_normal((3, 2))
    signal = 5.0 + sum(
        (phasors[i] * np.exp(2j * np.pi * line * t)[:, None]).real for i, line in enumerate((3, 8, 10.5))
    )
    np.testing.assert_allclose(spectrum(signal, periods, np.array([3, 8])), phasors[:2], atol=1e-12)
    np.testing.assert_allclose(spectrum(signal, periods, np.array([3.0, 8.0, 10.5])), phasors, atol=1e-12)
    np.testing.assert_allclose(spectrum(signal, periods, np.array([4, 9])), 0.0, atol=1e-12)
    odd = np.array([11, 3, 149])  # of both kinds, in any order
    expected = np.fft.rfft(signal.reshape(periods, samples, 2).mean(0), axis=0)[odd] * (2.0 / samples)
    np.testing.assert_allclose(spectrum(signal, periods, odd), expected, atol=1e-12)
    with refused("E-FRF-041", "150", "300"):
        spectrum(signal, periods, np.array([3, 150]))
    with refused("E-FRF-012", "2"):
        spectrum(signal, periods, np.array([3.25]))
    with refused("E-FRF-011"):
        spectrum(signal[:-1], periods, np.array([3]))


def test_noise_is_read_where_neither_response_nor_reference_is(make_plan):
    half = make_plan(
        reference_amplitude=0.02, reference_frequency_hz=2.25
    )  # 4.5 f0: even harmonics at 9, 27, 45 …
    assert noise_in_half_sum(half)
    np.testing.assert_array_equal(np.setdiff1d(half.lines, noise_lines(half)), [9, 27, 45, 63])

    grid = make_plan(reference_amplitude=0.02, reference_frequency_hz=2.5)
    assert not noise_in_half_sum(grid)
    assert set(noise_lines(grid) % 1.0) == {0.5}

    single = make_plan(signs=False, reference_amplitude=0.02, reference_frequency_hz=2.25)
    bins = noise_lines(single)
    assert set(bins % 1.0) == {0.5} and not np.isin([13.5, 22.5], bins).any()
    one_period = make_plan(signs=False, periods=2, settle_periods=1)
    assert (noise_lines(one_period) % 2 == 0).all()
    assert noise_in_half_sum(make_plan())
    with refused("E-FRF-013"):
        noise_lines(make_plan(reference_amplitude=0.02, reference_frequency_hz=0.25))


def fourier_of_steps(values, omega, step, fine=400):
    """∫ of the staircase of `values` against exp(-jωt), by the midpoint rule, over (samples)."""
    t = (np.arange(values.size * fine) + 0.5) * step / fine
    return (np.repeat(values, fine) * np.exp(-1j * omega * t)).sum() / fine


def test_held_factor_is_the_fourier_integral_of_the_staircase(make_plan, rng):
    plan, step = make_plan(torque="held"), 1.0 / 200.0
    values = rng.standard_normal(50)
    for bin_ in (1, 7, 20):
        omega = 2 * np.pi * bin_ / (values.size * step)
        sampled = np.fft.fft(values)[bin_]
        factor = torque_hold(plan, np.array([omega]), step)[0]
        np.testing.assert_allclose(
            sampled * factor, fourier_of_steps(values, omega, step), rtol=1e-4, atol=1e-4
        )


def test_mean_factor_undoes_the_mean_over_the_step(make_plan):
    plan, step = make_plan(torque="mean"), 1.0 / 200.0
    omega = 2 * np.pi * 35.0
    t = np.arange(40) * step
    means = (np.exp(1j * omega * (t + step)) - np.exp(1j * omega * t)) / (1j * omega * step)
    np.testing.assert_allclose(
        means * torque_hold(plan, np.array([omega]), step), np.exp(1j * omega * t), rtol=1e-12
    )
    np.testing.assert_array_equal(
        torque_hold(make_plan(torque="instantaneous"), np.array([omega]), step), 1.0
    )
