"""Link inertials, rotors and friction from periodic exciting trajectories, with CAD as the prior: Bayesian weighted least squares."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from flexcal.data.plans import TrajectoryPlan
from flexcal.data.recordings import Recording
from flexcal.dynamics.inertials.linearised_equations import LinearisedEquations, unknowns
from flexcal.dynamics.inertials.second_order_covariance import SecondOrderCovariance
from flexcal.dynamics.signals import PeriodicMotion
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate, Problem, solve
from flexcal.model.robot import RobotModel

_REACH = 6
"""Number of neighbouring lines on either side from which the noise of a line is estimated."""
_CORNERS = (1.0, 2.0, 4.0, 8.0, np.inf)
"""Candidate corner lines of a first-order spectrum, at which it has fallen by half; the last is white."""
_SMALLEST = 1e-9
"""Lower bound of the noise of exactly fitted torques, relative to them."""


def noise(rows: LinearisedEquations, estimate: Estimate, weighed: np.ndarray) -> np.ndarray:
    """Standard deviation (2 K + 1, n) of every coefficient of every joint, N m, smooth over the lines.

    From the residual of an estimate that was weighed with `weighed` (2 K + 1, n), less the freedom that it took from there. About every
    line the spectrum is first-order with an unknown level and corner, so that the level at zero is not that of the lines above, on one
    side of it. The variance is its posterior mean, ν / (ν - 2) times the usual one for ν degrees of freedom: with it the
    normal quantile holds what Student's t should (95 % for ν from 3 on). Raises `FlexcalError` where no two degrees are left.
    """
    step = estimate.parameters.coordinates() - rows.parameters.coordinates()
    squares = np.sum((rows.residual - rows.jacobian @ step) ** 2, axis=0)
    white = rows.jacobian / weighed[:, :, None]
    taken = np.einsum("tkjp,pr,tkjr->tkj", white, estimate.covariance, white, optimize=True)
    free = np.sum(1.0 - taken, axis=0)
    near = np.abs(rows.lines[:, None] - rows.lines) <= _REACH
    freedom = near @ free
    if freedom.min() <= 2.0:
        raise FlexcalError(
            "E-DYN-014",
            "the recordings leave too few lines to estimate their noise; record more or longer trajectories.",
        )
    shapes = 1.0 / (1.0 + (rows.lines / np.array(_CORNERS)[:, None]) ** 2)[:, :, None]
    sums = np.maximum(near @ (squares / shapes), (_SMALLEST * rows.size) ** 2)
    evidence = -0.5 * (near @ (free * np.log(shapes)) + freedom * np.log(sums))
    share = np.exp(evidence - evidence.max(axis=0))
    return np.sqrt(np.sum(share * shapes * sums, axis=0) / share.sum(axis=0) / (freedom - 2.0))


CUTOFF_HZ = 5.0
"""Highest line used: half the first resonance of a large arm, five times the highest harmonic of a designed trajectory."""
ROUNDS = 10
"""Largest number of linearisations, each with the noise of the last residual: masses multiply centres of mass."""
CONVERGED = 0.01
"""Square of the last step, in standard deviations, below which the linearisation is that of the optimum."""
CURVATURE_PASSES = 2
"""Number of evaluations of the second-order terms with the last covariance."""


def fit_inertials(model: RobotModel, plan: TrajectoryPlan, recordings: Iterable[Recording]) -> Estimate:
    """Posterior of mass, centre of mass, rotor inertia and friction of a robot from a plan's recordings.

    The rows are Fourier coefficients of the motor torques of one mean period (Swevers 1997). The prior is that of robot.yaml; beside the
    parameters, springs and geometry are unknown to their tolerances and marginalised. The weights are from the residual's own
    spectrum, joint by joint, so that its autocorrelation is accounted for. Raises `FlexcalError` where a rotor inertia is missing, a
    recording does not fit the plan, or a torque is zero throughout.
    """
    motions = [PeriodicMotion.of(log, plan, number, CUTOFF_HZ) for number, log in enumerate(recordings)]
    if not motions:
        raise FlexcalError(
            "E-DYN-015", "there is no recording of a trajectory to identify from; give at least one."
        )
    parameters, own = unknowns(model)
    rows = LinearisedEquations.about(model, parameters, motions, plan.payload)
    silent = [name for name, size in zip(model.joint_names, rows.size, strict=True) if not size > 0]
    if silent:
        raise FlexcalError("E-DYN-016", f"the torque of {silent[0]} is zero in all recordings; record it.")
    estimate = _fit(rows, rows.first_sigma())
    sigma = noise(rows, estimate, rows.first_sigma())
    for _ in range(ROUNDS):
        rows = LinearisedEquations.about(model, estimate.parameters, motions, plan.payload)
        estimate = _fit(rows, sigma)
        sigma = noise(rows, estimate, sigma)
        step = estimate.parameters.coordinates() - rows.parameters.coordinates()
        if step @ np.linalg.solve(estimate.covariance, step) < CONVERGED:
            break
    for _ in range(CURVATURE_PASSES):
        bent = SecondOrderCovariance.of(model, estimate, motions).added_to(rows)
        estimate = _fit(bent, sigma)
        sigma = noise(bent, estimate, sigma)
    return _marginal(estimate, own)


def _fit(rows: LinearisedEquations, sigma: np.ndarray) -> Estimate:
    about = rows.parameters.coordinates()
    right = (rows.residual / sigma).ravel()
    slope = -(rows.jacobian / sigma[:, :, None]).reshape(right.size, -1)
    return solve(Problem(rows.parameters, lambda x: (right + slope @ (x - about), slope)), tolerance=1e-6)


def _marginal(estimate: Estimate, names: tuple[str, ...]) -> Estimate:
    """Marginal estimate of some parameters, the others integrated out."""
    numbers = [estimate.parameters.index(name) for name in names]
    return replace(
        estimate,
        parameters=estimate.parameters.subset(names),
        covariance=estimate.marginal(names)[1],
        rank=len(names) - sum(entry.name in names for entry in estimate.dropped),
        dropped=tuple(entry for entry in estimate.dropped if entry.name in names),
        identifiable=tuple(estimate.identifiable[number] for number in numbers),
    )
