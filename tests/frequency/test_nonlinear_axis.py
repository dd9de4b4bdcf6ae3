"""One simulated axis with friction or a hardening spring: what the distortion does and how it is reported."""

from dataclasses import replace

import numpy as np
import pytest

from flexcal.data.recordings import Recording, RecordingLabel
from flexcal.frequency.periodic import (
    excitation_torque,
    noise_lines,
    odd_lines,
    pose_response,
    reference_trajectory,
    spectrum,
)

INERTIA, GAIN, DAMPING = 8.0, 3000.0, 150.0


def make_axis_plan(make_plan, reference_hz, **changes):
    lines = odd_lines(0.25, 3.0, 60.0)
    values = {
        "joints": (0,),
        "poses": np.zeros((1, 1)),
        "kp": np.array([GAIN]),
        "kd": np.array([DAMPING]),
        "base_frequency_hz": 0.25,
        "lines": lines,
        "amplitude": np.full((1, lines.size), 4.0),
        "rate_hz": 1000.0,
        "reference_amplitude": np.deg2rad(1.5),
        "reference_frequency_hz": reference_hz,
        "realisations": 8,
    }
    return make_plan(**(values | changes))


def record_axis(plan, coulomb=0.0, spring=0.0, cubic=0.0, noise=0.0, rng=None):
    """A rotor under PD control with feed-forward, 1 kHz held torque, 2 steps a sample; all records side by side.

    Coulomb friction is exact: an implicit step that stops the rotor where friction can hold it.
    """
    keys = [(r, s) for r in range(plan.realisations) for s in (1, -1)]
    excitation = np.stack([excitation_torque(plan, r, 0, s)[:, 0] for r, s in keys], 1)
    excitation = np.tile(excitation, (plan.periods, 1))
    step = 1.0 / plan.rate_hz
    angle, velocity, acceleration = reference_trajectory(plan, np.arange(len(excitation)) * step)
    q, v = np.zeros(len(keys)), np.full(len(keys), velocity[0])
    positions, torques = np.zeros_like(excitation), np.zeros_like(excitation)
    h = step / 2
    for i, excited in enumerate(excitation):
        forward = INERTIA * acceleration[i] + coulomb * np.sign(velocity[i])
        u = excited + GAIN * (angle[i] - q) + DAMPING * (velocity[i] - v) + forward
        positions[i], torques[i] = q, u
        for _ in range(2):
            free = v + h / INERTIA * (u - spring * q - cubic * q**3)
            v = np.sign(free) * np.maximum(np.abs(free) - h / INERTIA * coulomb, 0.0)
            q = q + h * v
    if noise:
        positions += noise * rng.standard_normal(positions.shape)
    for column, (r, s) in enumerate(keys):
        label = RecordingLabel(0, r, 0, s)
        yield Recording(time_step=step, q=positions[:, [column]], torque=torques[:, [column]], label=label)


def relative_scatter(found):
    return float(np.mean(found.std * np.sqrt(len(found.realisations)) / np.abs(found.response)))


@pytest.fixture(scope="module")
def sidebands():
    """Root mean square acceleration phasors of (plus - minus)/2 on (odd, even, half-integer) lines."""

    def find(recordings):
        kept = slice(8000, 16000)
        difference = 0.5 * (recordings[0].q[kept] - recordings[1].q[kept])
        k = np.arange(26, 479) / 2
        size = np.abs(spectrum(difference, 2, k))[:, 0] * k**2
        return [np.sqrt(np.mean(size[chosen] ** 2)) for chosen in (k % 2 == 1, k % 2 == 0, k % 1 == 0.5)]

    return find


def test_half_integer_reference_keeps_coulomb_sidebands_off_the_excited_lines(make_plan, sidebands):
    """Scatter of G 0.095 at 2.125 Hz against 0.157 at 2.25 Hz, one Coulomb axis."""
    scatter = {}
    for frequency in (2.125, 2.25):
        plan = make_axis_plan(make_plan, frequency)
        recordings = list(record_axis(plan, coulomb=30.0))
        found = pose_response(plan, 0, recordings)
        direct = np.sqrt((np.abs(found.realisations - found.realisations.mean(0)) ** 2).sum(0) / 7)
        scatter[frequency] = np.mean(direct / np.abs(found.response))
        assert (
            abs(relative_scatter(found) / scatter[frequency] - 1.0) < 0.1
        )  # pooling invents and loses nothing
        odd, even, half = sidebands(recordings)
        assert half < 0.01 * odd
        assert even > 0.08 * odd if frequency == 2.125 else even < 0.01 * odd
        assert np.mean(found.noise_std / found.std) < 0.05  # nothing of it is taken for noise
    assert 0.08 < scatter[2.125] < 0.11
    assert 0.13 < scatter[2.25] < 0.18


def test_noise_is_found_under_the_friction(make_plan):
    """Encoder noise of known size beside Coulomb distortion ten times larger: the bins chosen see the noise alone."""
    plan = make_axis_plan(make_plan, 2.125)
    rng = np.random.default_rng(0)
    recordings = list(record_axis(plan, coulomb=30.0, noise=1e-5, rng=rng))
    half_sum = 0.5 * (recordings[0].q + recordings[1].q)[8000:16000]
    lines = noise_lines(plan)
    high = lines[
        lines > 100
    ]  # lower down the smooth tail of the settling outweighs a noise of 1e-7 rad a line
    found = np.mean(np.abs(spectrum(half_sum, 2, high)) ** 2)
    expected = (1e-5**2 / 2) * 4 / 8000  # half sum, phasor scale 2/N squared times N
    assert 0.7 < found / expected < 1.4
    response = pose_response(plan, 0, recordings)
    assert (response.distortion_std[:-40] > 3 * response.noise_std[:-40]).mean() > 0.9


def test_cubic_stiffness_shows_as_distortion(make_plan):
    plan = make_axis_plan(make_plan, 2.125, reference_amplitude=0.0, kp=np.zeros(1))
    linear, cubic = (
        pose_response(
            plan, 0, record_axis(plan, spring=2e4, cubic=c, noise=1e-7, rng=np.random.default_rng(1))
        )
        for c in (0.0, 3e8)
    )
    low = plan.frequencies_hz < 20.0
    assert np.median(cubic.distortion_std[low] / cubic.noise_std[low]) > 5.0
    assert 0.7 < np.median(linear.std[low] / linear.noise_std[low]) < 1.3
    quieter = replace(plan, amplitude=plan.amplitude / 10)
    small = pose_response(
        quieter, 0, record_axis(quieter, spring=2e4, cubic=3e8, noise=1e-8, rng=np.random.default_rng(1))
    )
    ratio = np.median(cubic.distortion_std[low]) / np.median(np.maximum(small.distortion_std[low], 1e-12))
    assert ratio > 30.0  # a cubic: a tenth of the amplitude, a hundredth of the distortion
