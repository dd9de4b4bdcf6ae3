"""The covariance of a difference of two estimates against drawn data of a linear model, solved by NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flexcal.calibration.comparison.joint_covariance import difference_of_known, split_covariance
from flexcal.estimation import Dropped, Estimate, Parameter, Parameters

NAMES = ("a", "b", "held", "spring_1", "spring_2")
PRIOR = np.array([[4.0, 1.5], [1.5, 1.0]])
HELD = 2.0


def fitted(columns: np.ndarray, held: bool, same_springs: bool = True) -> tuple[np.ndarray, Estimate]:
    """Matrix (5, m) that makes the estimates of data with unit noise, and the estimate with its stored covariance."""
    information = columns.T @ columns
    information[3:, 3:] += np.linalg.inv(PRIOR)
    free = [0, 1, 3, 4] if held else [0, 1, 2, 3, 4]
    inside = np.linalg.inv(information[np.ix_(free, free)])
    gain = np.zeros((5, len(columns)))
    gain[free] = inside @ columns[:, free].T
    covariance = np.zeros((5, 5))
    covariance[np.ix_(free, free)] = inside
    if held:  # as fits store it: the estimate's response to a held value, times its prior
        response = np.zeros(5)
        response[free] = -inside @ columns[:, free].T @ columns[:, 2]
        covariance += HELD**2 * np.outer(response, response)
        covariance[:, 2] += HELD**2 * response
        covariance[2] += HELD**2 * response
        covariance[2, 2] = HELD**2
    parameters = Parameters(Parameter(name, "m", 0.0) for name in NAMES)
    known = (True, True, not held, True, True)
    dropped = (Dropped("held"),) if held else ()
    return gain, Estimate(parameters, covariance, 4, dropped, known, 1.0, 1.0, 500, "converged", "", 3)


@pytest.mark.parametrize(
    ("held", "same"), [((True, True), True), ((False, True), True), ((True, True), False)]
)
def test_what_both_know_beforehand_counts_once(
    rng: np.random.Generator, held: tuple[bool, bool], same: bool
) -> None:
    designs = [rng.normal(size=(count, 5)) * [1, 1, 1, 0.6, 0.8] for count in (12, 9)]
    sides = [fitted(columns, own) for columns, own in zip(designs, held, strict=True)]
    splits = [split_covariance(estimate, NAMES, {}, (NAMES[3:], PRIOR)) for _, estimate in sides]
    apart = () if same else NAMES[3:]
    known = difference_of_known(*splits, apart=apart)
    stated = splits[0].noise + splits[1].noise + known @ known.T
    draws, size = [], 40_000
    springs = [rng.multivariate_normal([0, 0], PRIOR, size) for _ in range(2)]
    hidden = HELD * rng.normal(size=size)
    for k, ((gain, _), columns) in enumerate(zip(sides, designs, strict=True)):
        truth = np.zeros((size, 5))
        truth[:, 2] = hidden
        truth[:, 3:] = springs[0 if same else k]
        seen = truth @ columns.T + rng.normal(size=(size, len(columns)))
        # springs that are not the same are no error of the estimates
        springless = np.hstack([np.zeros((size, 3)), truth[:, 3:]])
        draws.append(seen @ gain.T - (0 if same else 1) * springless)
    observed = np.cov((draws[1] - draws[0]).T)
    twice = sum(estimate.covariance for _, estimate in sides)
    spread = np.sqrt(np.outer(np.diag(twice), np.diag(twice)))
    np.testing.assert_allclose(observed / spread, stated / spread, atol=0.02)
    if all(held) and same:
        assert np.trace(stated) < 0.8 * np.trace(twice)
