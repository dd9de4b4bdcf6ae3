"""Link inertials, rotors and friction from periodic exciting trajectories, with CAD as the prior: Bayesian weighted least squares."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from flexcal.data import Recording, TrajectoryPlan
from flexcal.dynamics.curvature import Curvature
from flexcal.dynamics.periodic_motion import PeriodicMotion
from flexcal.dynamics.residual_noise import noise
from flexcal.dynamics.trajectory_rows import TrajectoryRows, unknowns
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate, Problem, solve
from flexcal.model import RobotModel

CUTOFF_HZ = 5.0
"""Highest line that is used: half the first resonance of a large arm, five times the highest harmonic of a designed trajectory."""
ROUNDS = 10
"""Largest number of linearisations, each with the noise read from the last residual: masses multiply centres of mass."""
CONVERGED = 0.01
"""Square of the last step, in standard deviations, below which the linearisation is that of the optimum."""
CURVATURE_PASSES = 2
"""How often the second-order terms are evaluated with the last covariance."""


def identify_with_prior(model: RobotModel, plan: TrajectoryPlan, recordings: Iterable[Recording]) -> Estimate:
    """Posterior of mass, centre of mass, rotor inertia and friction of a robot from a plan's recordings.

    The rows are Fourier coefficients of the motor torques of one mean period (Swevers 1997). The prior is that of robot.yaml; beside the
    parameters, springs and geometry are unknown to their tolerances and marginalised. The weights are from the residual's own
    spectrum, joint by joint, so that its autocorrelation is accounted for. Raises `FlexcalError` where a rotor inertia is missing, a
    recording does not fit the plan, or a torque is zero throughout.
    """
    motions = [PeriodicMotion.of(log, plan, number, CUTOFF_HZ) for number, log in enumerate(recordings)]
    if not motions:
        raise FlexcalError("there is no recording of a trajectory to identify from; give at least one.")
    parameters, own = unknowns(model)
    rows = TrajectoryRows.about(model, parameters, motions, plan.payload)
    silent = [name for name, size in zip(model.joint_names, rows.size, strict=True) if not size > 0]
    if silent:
        raise FlexcalError(f"the torque of {silent[0]} is zero in all recordings; record it.")
    estimate = _fit(rows, rows.first_sigma())
    sigma = noise(rows, estimate, rows.first_sigma())
    for _ in range(ROUNDS):
        rows = TrajectoryRows.about(model, estimate.parameters, motions, plan.payload)
        estimate = _fit(rows, sigma)
        sigma = noise(rows, estimate, sigma)
        step = estimate.parameters.coordinates() - rows.parameters.coordinates()
        if step @ np.linalg.solve(estimate.covariance, step) < CONVERGED:
            break
    for _ in range(CURVATURE_PASSES):
        bent = Curvature.of(model, estimate, motions).added_to(rows)
        estimate = _fit(bent, sigma)
        sigma = noise(bent, estimate, sigma)
    return _marginal(estimate, own)


def _fit(rows: TrajectoryRows, sigma: np.ndarray) -> Estimate:
    about = rows.parameters.coordinates()
    right = (rows.residual / sigma).ravel()
    slope = -(rows.jacobian / sigma[:, :, None]).reshape(right.size, -1)
    return solve(Problem(rows.parameters, lambda x: (right + slope @ (x - about), slope)), tolerance=1e-6)


def _marginal(estimate: Estimate, names: tuple[str, ...]) -> Estimate:
    """The estimate of some parameters, the others integrated out."""
    numbers = [estimate.parameters.index(name) for name in names]
    return replace(
        estimate,
        parameters=estimate.parameters.subset(names),
        covariance=estimate.marginal(names)[1],
        rank=len(names) - sum(entry.name in names for entry in estimate.dropped),
        dropped=tuple(entry for entry in estimate.dropped if entry.name in names),
        identifiable=tuple(estimate.identifiable[number] for number in numbers),
    )
