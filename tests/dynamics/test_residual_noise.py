"""The noise level of every line, that at zero among them, against the spectrum that the residual was drawn from."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

from flexcal.dynamics.inertials.bayesian_fit import noise
from flexcal.dynamics.inertials.linearised_equations import LinearisedEquations
from flexcal.estimation import Estimate, Parameter, Parameters

ABOVE = np.arange(1, 26)
LINES = np.concatenate([[0], ABOVE, ABOVE])
JOINTS = 4000


def drawn(spectrum: np.ndarray, recordings: int, rng: np.random.Generator) -> np.ndarray:
    """Coefficients (T, 51, n) of independent recordings whose variance at every line is `spectrum`."""
    return np.sqrt(spectrum)[:, None] * rng.standard_normal((recordings, len(LINES), JOINTS))


def level(residual: np.ndarray) -> np.ndarray:
    """Noise (51, n) of a residual from which an offset in every joint has been taken and nothing else."""
    parameters = Parameters([Parameter("offset", "N m", 0.0)])
    covariance = np.array([[1.0 / len(residual)]])
    estimate = Estimate(parameters, covariance, 1, (), (True,), 0.0, 0.0, 1, "converged", "", 1)
    jacobian = np.zeros((*residual.shape, 1))
    jacobian[:, 0, :, 0] = 1.0
    rows = LinearisedEquations(parameters, np.ones_like(residual), residual, jacobian)
    return noise(rows, estimate, np.ones(residual.shape[1:]))


@pytest.mark.parametrize("recordings", [2, 3])
@pytest.mark.parametrize("corner", [2.0, 4.0, 11.0, np.inf])
def test_offsets_are_within_their_intervals(corner: float, recordings: int) -> None:
    """An offset is the mean of the recordings; noise with a memory is stronger there than at the lines that tell how strong it is."""
    rng = np.random.default_rng(11)
    spectrum = 1.0 / (1.0 + (LINES / corner) ** 2)
    residual = drawn(spectrum, recordings, rng)
    offset = residual[:, 0].mean(axis=0)
    residual[:, 0] -= offset
    std = level(residual)[0] / np.sqrt(recordings)
    assert 0.93 < np.mean(np.abs(offset) < 1.96 * std) < 0.98


def test_levels_follow_the_spectrum() -> None:
    """Above zero, whose level is uncertain: where noise falls by a factor of twenty over the lines, and where it is white."""
    rng = np.random.default_rng(12)
    for corner in (5.0, np.inf):
        spectrum = 1.0 / (1.0 + (LINES / corner) ** 2) + 0.01
        found = np.median(level(drawn(spectrum, 3, rng)), axis=1)
        np.testing.assert_allclose(found[1:], np.sqrt(spectrum)[1:], rtol=0.15)


def test_too_few_lines_are_said() -> None:
    parameters = Parameters([Parameter("offset", "N m", 0.0)])
    estimate = Estimate(parameters, np.eye(1), 1, (), (True,), 0.0, 0.0, 1, "converged", "", 1)
    rows = LinearisedEquations(parameters, np.ones((1, 3, 1)), np.ones((1, 3, 1)), np.ones((1, 3, 1, 1)))
    with refused("E-DYN-014"):
        noise(rows, estimate, np.ones((3, 1)))
