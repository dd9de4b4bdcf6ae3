"""Fit with stiffness and inertia marginalised: their uncertainty adds J Σ Jᵀ to the residual's covariance R."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.fit.least_squares_problem import GeometryProblem
from flexcal.estimation import Estimate, Parameters, Problem, is_log_identified, solve
from flexcal.progress import Progress

_RELINEARISATIONS = 10
_SETTLED = 1e-4
"""Step of the marginalised parameters, in standard deviations of their prior, at which they have converged."""


def marginalised(fit: GeometryProblem, *, progress: Progress) -> Estimate:
    """Fit of the geometry alone, with stiffness and inertia θ then inferred from the residual r; same optimum as `fit.reestimated`.

    With S = R + J Σ Jᵀ the posterior is θ₀ + Σ Jᵀ S⁻¹ r, and geometry x and θ have the joint covariance of one Gaussian update. J is
    taken again about what was found until it stands still, which makes both ways agree beyond first order. There is no robust loss here:
    it would weigh poses one by one, but S ties them together.
    """
    kept, elastic = fit.kept, fit.prior.parameters
    linearisations = 0
    while True:
        about = _Marginal.about(fit, kept, elastic)
        estimate = solve(about.geometry_alone(), progress=progress)
        kept = estimate.parameters
        rest = about.shrunk(about.residual(_values(kept + elastic)))
        theta = elastic.prior_mean() + about.spread.T @ rest
        step = (theta - elastic.coordinates()) / np.sqrt(np.diag(fit.prior.covariance))
        elastic = elastic.with_coordinates(theta)
        linearisations += 1
        if np.abs(step).max() < _SETTLED or linearisations == _RELINEARISATIONS:
            break
    return _joint(_Marginal.about(fit, kept, elastic), estimate)


@dataclass(frozen=True, eq=False)
class _Marginal:
    """Marginal covariance S at given geometry and elasticity, as W with WᵀW = S⁻¹, rows whitened by R⁻¹ᐟ² beforehand.

    With R⁻¹ᐟ² J Σ¹ᐟ² = Q s Pᵀ, W = 1 - Q diag(1 - (1 + s²)⁻¹ᐟ²) Qᵀ. `slopes` (3 N, t) is R⁻¹ᐟ² J, `spread` (3 N, t) is W R⁻¹ᐟ² J Σ, so that
    Σ Jᵀ S⁻¹ = spreadᵀ W; `shift` (3 N,) is how far the elasticity's step from its prior has already moved the points.
    """

    fit: GeometryProblem
    kept: Parameters
    elastic: Parameters
    slopes: np.ndarray
    shift: np.ndarray
    basis: np.ndarray
    lost: np.ndarray

    @classmethod
    def about(cls, fit: GeometryProblem, kept: Parameters, elastic: Parameters) -> _Marginal:
        at = fit.predicted(_values(kept + elastic), jacobians=True)
        slopes = fit.columns(at, elastic.names) * elastic.natural_slope(elastic.coordinates())
        values, vectors = np.linalg.eigh(fit.prior.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        basis, sizes, _ = np.linalg.svd(slopes @ root, full_matrices=False)
        shift = slopes @ (elastic.coordinates() - elastic.prior_mean())
        return cls(fit, kept, elastic, slopes, shift, basis, 1 - 1 / np.sqrt(1 + sizes**2))

    def shrunk(self, rows: np.ndarray) -> np.ndarray:
        """Product of W with whitened rows (3 N,) or (3 N, k)."""
        return rows - self.basis @ ((self.basis.T @ rows).T * self.lost).T

    def residual(self, values: dict[str, float]) -> np.ndarray:
        """Whitened residual (3 N,) with the elasticity at its prior."""
        return self.fit.residual(self.fit.predicted(values)) + self.shift

    @property
    def spread(self) -> np.ndarray:
        return self.shrunk(self.slopes @ self.fit.prior.covariance)

    def geometry_alone(self) -> Problem:
        """Least-squares problem of the geometry, with θ fixed and S as the covariance."""
        fit, kept, elastic_values = self.fit, self.kept, _values(self.elastic)

        def values(x: np.ndarray) -> dict[str, float]:
            return elastic_values | dict(zip(kept.names, kept.natural(x), strict=True))

        def linearise(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            at = fit.predicted(values(x), jacobians=True)
            columns = fit.columns(at, kept.names) * kept.natural_slope(x)
            return self.shrunk(fit.residual(at) + self.shift), -self.shrunk(columns)

        def residual(x: np.ndarray) -> np.ndarray:
            return self.shrunk(self.residual(values(x)))

        return Problem(kept, linearise, residual, fit.kept_covariance)


def _joint(at: _Marginal, geometry: Estimate) -> Estimate:
    """Joint estimate of geometry and elasticity: cov(x, θ) = -P (K A)ᵀ and cov(θ) = Σ - K J Σ + K A P (K A)ᵀ.

    P is the geometry's covariance, A = ∂(points)/∂x, J = ∂(points)/∂θ and K = Σ Jᵀ S⁻¹.
    """
    fit, parameters, spread = at.fit, at.kept + at.elastic, at.spread
    predicted = fit.predicted(_values(parameters), jacobians=True)
    by_geometry = fit.columns(predicted, at.kept.names)
    absorbed = spread.T @ at.shrunk(by_geometry)
    across = absorbed @ geometry.covariance
    own = fit.prior.covariance - spread.T @ spread + across @ absorbed.T
    covariance = np.block([[geometry.covariance, -across.T], [-across, own]])
    rows = np.hstack([by_geometry, at.slopes])
    effective = float(np.sum((rows @ covariance) * rows))
    return replace(
        geometry,
        parameters=parameters,
        covariance=covariance,
        rank=geometry.rank + len(at.elastic),
        identifiable=geometry.identifiable + is_log_identified(at.elastic, own),
        chi2=float(np.sum(fit.residual(predicted) ** 2)),
        degrees_of_freedom=max(0, round(len(rows) - effective)),
    )


def _values(parameters: Parameters) -> dict[str, float]:
    return {item.name: item.value for item in parameters}
