"""Predicted torques and their spectra, against the products and against scipy's Welch estimate."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import welch

from flexcal.data.recordings import Decimation
from flexcal.dynamics.diagnostics import TorquePrediction, predict_torques
from flexcal.dynamics.inverse_model import CLASSIC, Observation
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel

NOISE = 0.3


@pytest.fixture(scope="module")
def swinging(tx40: RobotModel, swing: Motion) -> tuple[Observation, np.ndarray, Motion]:
    """Torques of random parameters on a known motion, with white noise."""
    rng = np.random.default_rng(5)
    observation = Observation(tx40, CLASSIC)
    parameters = rng.normal(size=len(observation.names))
    exact = np.stack(
        [
            parameters[m] @ w
            for m, w in zip(observation.column_indices, observation.columns(swing), strict=True)
        ],
        axis=1,
    )
    return observation, parameters, replace(swing, torque=exact + NOISE * rng.normal(size=exact.shape))


def predicted(
    swinging: tuple[Observation, np.ndarray, Motion], points: int, border: float = math.inf
) -> TorquePrediction:
    observation, parameters, motion = swinging
    return predict_torques(
        observation, parameters, motion, Decimation(1), held_out_from=border, points=points
    )


def test_the_rows_are_those_of_the_motion(swinging: tuple[Observation, np.ndarray, Motion]) -> None:
    found, motion = predicted(swinging, 10_000), swinging[2]
    inside = np.isin(motion.time, found.time)
    np.testing.assert_allclose(found.measured, motion.torque[inside], rtol=1e-9)
    left = found.measured - found.predicted
    assert len(found.time) > 1900 and np.std(left) == pytest.approx(NOISE, rel=0.03)


def test_spectra_are_welchs(swinging: tuple[Observation, np.ndarray, Motion]) -> None:
    """Also where the figure is thinned; and white noise has its density, 2 σ² Δt, everywhere."""
    whole, thinned = predicted(swinging, 10_000), predicted(swinging, 100)
    for values, density in (
        (whole.measured, whole.measured_density),
        (whole.measured - whole.predicted, whole.residual_density),
    ):
        length = 2 * len(whole.frequencies_hz)
        frequencies, expected = welch(values, 200.0, "hann", length, axis=0)
        np.testing.assert_allclose(whole.frequencies_hz, frequencies[1:], rtol=1e-9)
        np.testing.assert_allclose(density, expected[1:], rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(thinned.residual_density, whole.residual_density)
    assert whole.residual_density[3:-1].mean() == pytest.approx(2 * NOISE**2 / 200, rel=0.1)


def test_thinning_keeps_every_so_manieth_row(swinging: tuple[Observation, np.ndarray, Motion]) -> None:
    whole, thinned = predicted(swinging, 10_000), predicted(swinging, 100)
    assert thinned.stride > 1 and len(thinned.time) <= 101
    np.testing.assert_array_equal(thinned.time, whole.time[:: thinned.stride])
    np.testing.assert_array_equal(thinned.predicted, whole.predicted[:: thinned.stride])


def test_what_was_held_out_is_marked(swinging: tuple[Observation, np.ndarray, Motion]) -> None:
    assert not predicted(swinging, 100).held_out.any()
    late = predicted(swinging, 10_000, border=7.0)
    np.testing.assert_array_equal(late.held_out, late.time >= 7.0)
