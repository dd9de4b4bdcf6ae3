"""Share of fed-back noise in an input, against the closed form of a loop of first order, and in open loop."""

from __future__ import annotations

import numpy as np
import pytest

from flexcal.frequency.arbitrary import ExcitationRecord, Feedback, detect_tones, feedback

POLE, GAIN, STEP = 0.9, 0.2, 1e-2
"""x' = 0.9 x + 0.2 u"""


def record(u: np.ndarray, y: np.ndarray) -> ExcitationRecord:
    return ExcitationRecord("log", STEP, u[:, None], y[:, None], np.zeros((len(u), 0)))


def loop(rng: np.random.Generator, asked: np.ndarray, noise: float, gain: float) -> ExcitationRecord:
    """u = asked - gain (x + e)"""
    u, y, x = np.empty(len(asked)), np.empty(len(asked)), 0.0
    for k, e in enumerate(noise * rng.normal(size=len(asked))):
        y[k] = x + e
        u[k] = asked[k] - gain * y[k]
        x = POLE * x + GAIN * u[k]
    return record(u, y)


def found(piece: ExcitationRecord) -> Feedback:
    result = feedback([piece], [False])
    assert result is not None
    return result


@pytest.mark.parametrize("noise", [0.1, 0.5, 2.0])
def test_share_and_bias_are_those_of_the_loop(noise: float) -> None:
    """Of white references and noise: α = (gain σ_e)² / ((gain σ_e)² + σ_r²), and the response is (1 - α) G - α / gain."""
    rng, gain = np.random.default_rng(1), 1.5
    result = found(loop(rng, rng.normal(size=20000), noise, gain))
    share = (gain * noise) ** 2 / ((gain * noise) ** 2 + 1.0)
    assert np.mean(result.share) == pytest.approx(share, abs=0.04)
    assert np.std(result.share) < 0.1
    g = GAIN / (np.exp(2j * np.pi * result.frequencies_hz * STEP) - POLE)
    bias = -share * (1.0 + 1.0 / (gain * g))
    error = np.abs(result.bias[:, 0, 0] - bias)
    assert np.median(error) < 0.1 * np.abs(bias).max() + 0.02
    assert result.acts == (share > 0.3)


@pytest.mark.parametrize("kind", ["noise", "band", "sweep", "multisine", "steps"])
def test_in_open_loop_nothing_is_fed_back(kind: str) -> None:
    rng, t = np.random.default_rng(2), STEP * np.arange(8000)
    asked = rng.normal(size=8000)
    if kind == "band":
        lines = np.fft.rfft(asked)
        lines[400:] = 0.0
        asked = np.fft.irfft(lines, 8000)
    elif kind == "sweep":
        asked = np.sin(2 * np.pi * (0.1 * t + 0.05 * t**2))
    elif kind == "multisine":
        asked = np.tile(
            np.fft.irfft(np.r_[0, np.exp(2j * np.pi * rng.uniform(size=80)), np.zeros(720)], 1600), 5
        )
    elif kind == "steps":
        asked = np.repeat(rng.normal(size=80), 100)
    result = found(loop(rng, asked / asked.std(), 0.3, 0.0))
    assert not result.acts and result.share.max() < 0.25


def test_beyond_an_excitation_a_loop_shows_the_controller() -> None:
    rng, t = np.random.default_rng(3), STEP * np.arange(8000)
    result = found(loop(rng, 5 * np.sin(2 * np.pi * (0.1 * t + 0.05 * t**2)), 0.05, 1.5))
    assert result.acts
    assert result.share_at(np.array([2.0, 5.0])).max() < 0.1
    assert result.share_at(np.array([20.0, 30.0])).min() > 0.9


def test_friction_in_a_sweep_is_no_controller() -> None:
    """Two masses on a spring, the first with a third of the torque as Coulomb friction, in small steps; sensor noise besides."""
    rng, fine = np.random.default_rng(6), 10
    t = np.arange(8000) / 1000
    torque = 42 * np.sin(2 * np.pi * (t + 59 * t**2 / 16))
    x, v, step, angle = [0.0, 0.0], [0.0, 0.0], 1e-3 / fine, []
    for force in torque:
        angle.append(x[0])
        for _ in range(fine):
            spring = 9e3 * (x[0] - x[1]) + 6 * (v[0] - v[1])
            free = v[0] + step * (force - spring - 5 * v[0]) / 2
            stopped = max(abs(free) - step * 10 / 2, 0.0)
            v = [stopped if free > 0 else -stopped, v[1] + step * spring / 3]
            x = [x[0] + step * v[0], x[1] + step * v[1]]
    seen = np.array(angle) + 1e-5 * rng.normal(size=8000)
    piece = ExcitationRecord("log", 1e-3, torque[:, None], seen[:, None], np.zeros((8000, 0)))
    assert not found(piece).acts


def test_short_records_do_not_tell() -> None:
    rng = np.random.default_rng(4)
    assert feedback([record(rng.normal(size=100), rng.normal(size=100))], [False]) is None


def test_few_lines_are_named() -> None:
    t, rng = STEP * np.arange(2000), np.random.default_rng(5)
    one, two = np.sin(2 * np.pi * 7.03 * t), np.sin(2 * np.pi * 11 * t)
    zero = np.zeros(2000)
    single = detect_tones([record(one, zero)])
    assert single is not None and single.frequencies_hz == pytest.approx((7.03,), abs=0.01)
    assert "a sine of one frequency, 7.03 Hz" in single.sentence
    pair = detect_tones([record(one, zero), record(two, zero)])
    assert pair is not None and pair.alone and len(pair.frequencies_hz) == 2
    nearly = detect_tones([record(one + 0.1 * rng.normal(size=2000), zero)])
    assert nearly is not None and not nearly.alone and "nearly a sine" in nearly.sentence
    assert detect_tones([record(rng.normal(size=2000), zero)]) is None
    assert detect_tones([record(np.sin(2 * np.pi * (0.1 * t + 0.5 * t**2)), zero)]) is None
