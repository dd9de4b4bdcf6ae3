"""Profile likelihoods against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from flexcal.elasticity.identification.profile_std import profile_std_ratio
from flexcal.estimation import Parameter, Parameters, Problem, profile_cost_increase, solve

TRUE = 2e5


def test_rise_of_a_linear_problem(rng):
    """With normal equations H the rise is ½ δ² / (H⁻¹)ᵢᵢ, the prior included."""
    design, measured = rng.standard_normal((30, 3)), rng.standard_normal(30)
    parameters = Parameters([Parameter(name, "1", 0.0, prior_std=2.0) for name in "abc"])
    problem = Problem(parameters, lambda x: (measured - design @ x, -design))
    fitted = solve(problem)
    x = fitted.parameters.coordinates()
    x[1] += 0.7
    variance = np.linalg.inv(design.T @ design + np.eye(3) / 4)[1, 1]
    assert profile_cost_increase(problem, fitted, x, [1]) == pytest.approx(0.5 * 0.7**2 / variance, rel=1e-9)


def stiffness_problem(residual):
    """One stiffness on a log scale, and the other parameter that profiles are refitted by; `residual(k / TRUE)` and its slope."""
    parameters = Parameters(
        [
            Parameter("joint_1.drive.stiffness", "N m/rad", TRUE, scale="log"),
            Parameter("other", "1", 0.0),
        ]
    )

    def linearise(x):
        value, slope = residual(np.exp(x[0]) / TRUE)
        jacobian = np.array([[slope * np.exp(x[0]) / TRUE, 0.3], [0.0, 1.0]])
        return np.array([value + 0.3 * x[1], x[1]]), jacobian

    return Problem(parameters, linearise)


def test_response_linear_in_the_compliance_is_not_widened():
    std = 0.2
    problem = stiffness_problem(lambda k: ((1 / k - 1) / std, -1 / (k**2 * std)))
    fitted = solve(problem)
    known = np.sqrt(np.diag(fitted.covariance))
    np.testing.assert_allclose(profile_std_ratio(problem, fitted, known), 1.0, rtol=1e-6)


@pytest.mark.parametrize("depth", [0.5, 1.0, 2.0])
def test_a_narrow_shallow_dip_is_widened(depth):
    """A mode that follows the noise: curved like a std of 0.15, but nowhere more than `depth` better than without it."""
    std = 0.15

    def residual(k):
        u = np.log(k) / std
        return u / np.sqrt(1 + u**2 / depth**2), (1 + u**2 / depth**2) ** -1.5 / (std * k)

    problem = stiffness_problem(residual)
    fitted = solve(problem)
    curved = np.sqrt(fitted.covariance[0, 0])
    assert curved == pytest.approx(std * np.sqrt(1 + 0.3**2))
    at_twice = residual(2.0)[0] ** 2 / (1 + 0.3**2)
    expected = max(1.0, 0.5 / (curved * np.sqrt(at_twice)))
    assert expected > 1.3
    known = np.sqrt(np.diag(fitted.covariance))
    np.testing.assert_allclose(profile_std_ratio(problem, fitted, known), [expected, 1.0], rtol=1e-5)
