"""Anderson's acceleration: finite on linear iterations, and the same minimum in fewer steps where residuals are curved."""

import numpy as np

from flexcal.estimation import Parameter, Parameters, Problem, solve
from flexcal.estimation.anderson_acceleration import AndersonAcceleration


def test_linear_iterations_end_after_as_many_steps_as_they_have_rates() -> None:
    """As GMRES (Walker & Ni 2011): a linear iteration with two different rates is solved by two points beside the first."""
    rng = np.random.default_rng(1)
    axes = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    rates = (axes * [0.8, 0.8, 0.8, -0.5, -0.5, -0.5]) @ axes.T
    solution, x = rng.normal(size=6), np.zeros(6)
    acceleration = AndersonAcceleration()
    for _ in range(3):
        x = x + acceleration.step(x, (rates - np.eye(6)) @ (x - solution), np.eye(6))
    assert np.abs(x - solution).max() < 1e-12


def test_begins_anew_after_it_forgot() -> None:
    acceleration, x = AndersonAcceleration(), np.zeros(2)
    acceleration.step(x, np.array([1.0, 0.0]), np.eye(2))
    acceleration.forget()
    plain = np.array([0.5, 0.1])
    assert not acceleration.extrapolates
    assert (acceleration.step(np.array([1.0, 0.0]), plain, np.eye(2)) == plain).all()


def test_curved_residuals_take_few_steps() -> None:
    """Points about a circle, its centre and radius: Gauss-Newton contracts by the residuals over the radius, here 0.6 a step or slower.

    The minimum is that of SciPy's BFGS on the same cost.
    """
    from scipy.optimize import minimize

    rng = np.random.default_rng(3)
    angle = rng.uniform(-0.6, 0.6, 60)
    points = np.column_stack([np.cos(angle), np.sin(angle)]) * (1 + 0.12 * rng.normal(size=60))[:, None]

    def linearise(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        apart = points - x[:2]
        distance = np.linalg.norm(apart, axis=1)
        return distance - x[2], np.column_stack([-apart / distance[:, None], -np.ones(60)])

    parameters = Parameters(
        Parameter(name, "m", value) for name, value in (("x", 0.1), ("y", 0.0), ("radius", 0.9))
    )
    estimate = solve(Problem(parameters, linearise))
    x = estimate.parameters.coordinates()
    best = minimize(lambda x: 0.5 * float(np.sum(linearise(x)[0] ** 2)), x + 1e-3, tol=1e-12)
    assert estimate.status == "converged"
    assert np.abs(x - best.x).max() < 1e-5
    # as many plain Gauss-Newton steps do not come as near
    at = parameters.coordinates()
    for _ in range(estimate.iterations):
        residual, slopes = linearise(at)
        at = at - np.linalg.lstsq(slopes, residual, rcond=None)[0]
    residual, slopes = linearise(at)
    offset = np.linalg.norm(np.linalg.qr(slopes)[0].T @ residual) / np.linalg.norm(residual)
    assert offset > 1e-5
