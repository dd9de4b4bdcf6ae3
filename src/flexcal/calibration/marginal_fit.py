"""The same fit with stiffness and inertia marginalised: their uncertainty widens the residual's covariance to R + J Σ Jᵀ."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.geometry_fit import GeometryFit, columns_of
from flexcal.estimation import Estimate, Parameters, Problem, solve
from flexcal.estimation.uncertainty import known_to_a_factor_of_two

_RELINEARISATIONS = 10
_SETTLED = 1e-4
"""Step of the marginalised parameters, in standard deviations of their prior, below which they count as found."""


def marginalised(fit: GeometryFit, *, progress: Callable[[int, float], None] | None) -> Estimate:
    """Fit the geometry alone, then read stiffness and inertia θ off the residual r: what `fit.reestimated` finds, by another way.

    With S = R + J Σ Jᵀ the posterior is θ₀ + Σ Jᵀ S⁻¹ r, and geometry x and θ have the joint covariance of one Gaussian update. J is
    taken again about what was found until it stands still, which makes both ways agree beyond first order. There is no robust loss here:
    it would weigh poses one by one, but S ties them together.
    """
    kept, elastic = fit.kept, fit.prior.parameters
    for _ in range(_RELINEARISATIONS):
        about = _Marginal.about(fit, kept, elastic)
        estimate = solve(about.geometry_alone(), progress=progress)
        kept = estimate.parameters
        rest = about.whitened(fit.residual(fit.predicted(_values(kept + elastic))) + about.shift)
        found = elastic.prior_mean() + about.spread.T @ rest
        step = (found - elastic.coordinates()) / np.sqrt(np.diag(fit.prior.covariance))
        elastic = elastic.with_coordinates(found)
        if np.abs(step).max() < _SETTLED:
            break
    return _joint(_Marginal.about(fit, kept, elastic), estimate)


@dataclass(frozen=True, eq=False)
class _Marginal:
    """S about some values of geometry and elasticity, as W with WᵀW = S⁻¹.

    With R⁻¹ᐟ² J Σ¹ᐟ² = Q s Pᵀ, W = (1 - Q diag(1 - (1 + s²)⁻¹ᐟ²) Qᵀ) R⁻¹ᐟ². `slopes` (3 N, t) is J, `spread` (3 N, t) is W J Σ, so that
    Σ Jᵀ S⁻¹ = spreadᵀ W; `shift` (3 N,) m is how far the elasticity's step from its prior has already moved the points.
    """

    fit: GeometryFit
    kept: Parameters
    elastic: Parameters
    slopes: np.ndarray
    shift: np.ndarray
    basis: np.ndarray
    lost: np.ndarray

    @classmethod
    def about(cls, fit: GeometryFit, kept: Parameters, elastic: Parameters) -> _Marginal:
        at = fit.predicted(_values(kept + elastic), jacobians=True)
        slopes = columns_of(at, elastic.names) * elastic.natural_slope(elastic.coordinates())
        values, vectors = np.linalg.eigh(fit.prior.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        basis, sizes, _ = np.linalg.svd(slopes @ root / fit.sigma[:, None], full_matrices=False)
        shift = slopes @ (elastic.coordinates() - elastic.prior_mean())
        return cls(fit, kept, elastic, slopes, shift, basis, 1 - 1 / np.sqrt(1 + sizes**2))

    def whitened(self, rows: np.ndarray) -> np.ndarray:
        """W times rows (3 N,) or (3 N, k)."""
        scaled = (rows.T / self.fit.sigma).T
        return scaled - self.basis @ ((self.basis.T @ scaled).T * self.lost).T

    @property
    def spread(self) -> np.ndarray:
        return self.whitened(self.slopes @ self.fit.prior.covariance)

    def geometry_alone(self) -> Problem:
        """The least-squares problem of the geometry, with θ where it is and S as the covariance."""
        fit, kept, held = self.fit, self.kept, _values(self.elastic)

        def values(x: np.ndarray) -> dict[str, float]:
            return held | dict(zip(kept.names, kept.natural(x), strict=True))

        def linearise(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            at = fit.predicted(values(x), jacobians=True)
            columns = columns_of(at, kept.names)
            return self.whitened(fit.residual(at) + self.shift), -self.whitened(columns)

        def residual(x: np.ndarray) -> np.ndarray:
            return self.whitened(fit.residual(fit.predicted(values(x))) + self.shift)

        return Problem(kept, linearise, residual)


def _joint(at: _Marginal, geometry: Estimate) -> Estimate:
    """The estimate of geometry and elasticity together: cov(x, θ) = -P (K A)ᵀ and cov(θ) = Σ - K J Σ + K A P (K A)ᵀ.

    P is the geometry's covariance, A = ∂(points)/∂x, J = ∂(points)/∂θ and K = Σ Jᵀ S⁻¹.
    """
    fit, parameters, spread = at.fit, at.kept + at.elastic, at.spread
    predicted = fit.predicted(_values(parameters), jacobians=True)
    by_geometry = columns_of(predicted, at.kept.names)
    absorbed = spread.T @ at.whitened(by_geometry)
    across = absorbed @ geometry.covariance
    own = fit.prior.covariance - spread.T @ spread + across @ absorbed.T
    covariance = np.block([[geometry.covariance, -across.T], [-across, own]])
    rows = np.hstack([by_geometry, at.slopes]) / fit.sigma[:, None]
    effective = float(np.sum((rows @ covariance) * rows))
    return replace(
        geometry,
        parameters=parameters,
        covariance=covariance,
        rank=geometry.rank + len(at.elastic),
        identifiable=geometry.identifiable + known_to_a_factor_of_two(at.elastic, own),
        chi2=float(np.sum((fit.residual(predicted) / fit.sigma) ** 2)),
        degrees_of_freedom=max(0, round(len(rows) - effective)),
    )


def _values(parameters: Parameters) -> dict[str, float]:
    return {item.name: item.value for item in parameters}
