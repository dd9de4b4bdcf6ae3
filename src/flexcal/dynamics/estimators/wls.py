"""Weighted least squares: the equations of each joint (or motor alone) and experiment weighted by their own noise (Eqs. 2.29-2.31)."""

from __future__ import annotations

import numpy as np

from flexcal.dynamics.estimators.linear_least_squares import Unknowns, linear_fit, weighted_system
from flexcal.dynamics.regression import RegressionData, Subsystem
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.model.parts import LINK_PARAMETERS

_FIRST, _ROUNDS = 1e-2, 3
"""Initial noise of undriven equations relative to the torques of their links, and number of its updates."""


def weighted_least_squares(data: RegressionData) -> Estimate:
    """Estimate χ̂ with the equations of each subsystem divided by its `noise_levels`; raises `FlexcalError` as that and `linear_fit` do."""
    return linear_fit(data, noise_levels(data))


def noise_levels(data: RegressionData) -> list[float]:
    """Noise σ̂ of each subsystem, N m, from its own fit, by rows less rank (Eq. 2.28).

    A subsystem that its own parameters fit exactly counts as if it had 1e-12 of its torque as noise. One that nobody drives would be
    fitted by zeros alone: its noise is what a fit of all equations leaves of it, begun with a hundredth of what its links ask. Raises
    `FlexcalError` where a subsystem has no more rows than it determines parameters.
    """
    noise = []
    for s, (sigma, rank) in zip(data.subsystems, data.noise(), strict=True):
        if np.isnan(sigma):
            label = data.observation.labels[s.equation]
            raise FlexcalError(
                "E-DYN-012",
                f"{s.triangle.rows} equations of {label} in experiment {s.experiment + 1} do not determine its noise beside "
                f"{rank} parameters; "
                "record for longer, or decimate less.",
            )
        noise.append(_first(data, s) if s.undriven else s.floored(sigma))
    for _ in range(_ROUNDS if any(s.undriven for s in data.subsystems) else 0):
        parameters = _fitted(data, noise)
        noise = [
            _left(s, parameters) if s.undriven else sigma
            for s, sigma in zip(data.subsystems, noise, strict=True)
        ]
    return noise


def _fitted(data: RegressionData, noise: list[float]) -> np.ndarray:
    """All parameters (p,) by least squares, without covariance."""
    system = weighted_system(data, noise)
    unknowns = Unknowns.of(data, system)
    factor, scale = unknowns.reduced(system)
    parameters = data.observation.values()
    parameters[unknowns.kept] += scale * np.linalg.solve(factor[:-1, :-1], factor[:-1, -1])
    return parameters


def _first(data: RegressionData, s: Subsystem) -> float:
    """Initial noise (N m) of an undriven subsystem: a share of its links' torques by CAD, else of the measured torques."""
    links = s.column_indices < len(LINK_PARAMETERS) * data.observation.model.n
    asked = s.triangle.matrix[:, links] @ data.observation.values()[s.column_indices[links]]
    sizes = [np.linalg.norm(o.triangle.right) / np.sqrt(o.triangle.rows) for o in data.subsystems]
    return _FIRST * (float(np.linalg.norm(asked)) / np.sqrt(s.triangle.rows) or float(max(sizes))) or 1.0


def _left(s: Subsystem, parameters: np.ndarray) -> float:
    """Root mean square residual (N m) of an undriven subsystem, at least 1e-12 of its links' torques."""
    own = parameters[s.column_indices]
    terms = s.triangle.matrix * own
    least = 1e-12 * float(np.abs(terms).max())
    return max(s.triangle.residual(own), least) / np.sqrt(s.triangle.rows) or 1.0
