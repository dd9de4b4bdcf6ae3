"""Shape of the noise about a response, from errors that were drawn here."""

from __future__ import annotations

import numpy as np
import pytest

from flexcal.elasticity.modal.noise_shape import noise_shape

BINS = 360
FREQUENCY = np.linspace(2.0, 62.0, BINS)
RATIO = FREQUENCY / 14.0
GAIN = -(RATIO**2) / (1 - RATIO**2 + 0.08j * RATIO)


def drawn(std: np.ndarray, records: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    size = (records, BINS, 1)
    return std[:, None] * (rng.normal(size=size) + 1j * rng.normal(size=size)) / np.sqrt(2)


@pytest.mark.parametrize("periods", [1, 3])
@pytest.mark.parametrize("records", [1, 4])
def test_disturbances_of_the_input_show_at_the_resonance(records: int, periods: int) -> None:
    true = np.hypot(0.3, 0.1 * np.abs(GAIN))
    excited = np.arange(BINS) % periods == 0
    peak, far = np.argmin(np.abs(FREQUENCY - 14.0)), np.argmin(np.abs(FREQUENCY - 30.0))
    ratios = []
    for seed in range(20):
        shape = noise_shape(drawn(true, records, seed), GAIN[:, None, None], excited, 49)
        ratios.append(shape[peak] / shape[far])
    assert np.median(ratios) == pytest.approx(true[peak] / true[far], rel=0.25)


def test_noise_of_the_output_alone_has_no_shape() -> None:
    """The likelihood must rise by far more than chance."""
    flat, excited = np.full(BINS, 0.2), np.ones(BINS, bool)
    shaped = [
        noise_shape(drawn(flat, 2, seed), GAIN[:, None, None], excited, 49).std() > 0 for seed in range(100)
    ]
    assert np.mean(shaped) <= 0.03
