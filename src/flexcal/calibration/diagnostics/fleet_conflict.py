"""Whether a robot is of the model whose prior its calibration had."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.error_model import TRANSMISSION
from flexcal.calibration.fit import FleetPrior, GeometricFit
from flexcal.calibration.measurement import predict_measurements
from flexcal.estimation import individuals

_DRAWS = 400
"""Robots of the model that are drawn for comparison."""
CONTRADICTED = 0.01
"""Probability below which the prior does not fit the robot."""
_SIZES = np.geomspace(1.0, 1e5, 40)
"""Squared sizes of the deviation from the prior's mean that are tried, relative to the prior's."""
_NOISES = np.geomspace(1e-5, 1e3, 80)
"""Variances of the errors of the measurements that are tried, relative to those of the fit."""
_SEEN = 1e-9
_NAMED = 3.0
"""Deviation, in standard deviations of the prior, from which a parameter is named."""
_LISTED = 3


@dataclass(frozen=True)
class FleetConflict:
    """Test of a prior from other robots: this one deviates from them `size` times as much as they do from each other.

    `probability` is that of a likelihood ratio as large where it is one of them, `shifts` (name, deviations in standard deviations of the
    prior) say where it deviates, the farthest first, and `deviating` in how many parameters by more than three.
    """

    size: float
    probability: float
    shifts: tuple[tuple[str, float], ...]
    deviating: int

    @property
    def contradicted(self) -> bool:
        """Whether the prior does not fit the robot."""
        return self.probability < CONTRADICTED and self.size > 1.0

    def document(self) -> dict[str, Any]:
        """Entry of results.json."""
        return {
            "size": self.size,
            "probability": self.probability,
            "contradicted": self.contradicted,
            "shifts": dict(self.shifts),
            "deviating": self.deviating,
        }

    @classmethod
    def of(cls, fit: GeometricFit) -> FleetConflict | None:
        """Test of the prior of a fit, linearised at its solution; None for a fit without one.

        What the measurements say of the robot is compared with the prior by the likelihood of two variances, after projection off all
        other parameters: with s² times the errors' variance and φ² times the prior's covariance, the maximum over φ ≥ 1 and s against that
        over s at φ = 1. The errors need not be known: directions in which the prior is sharper than the measurements tell s. The
        distribution of the ratio is that of robots drawn from the prior, whose spread is known with few degrees of freedom where it is
        from few robots.
        """
        fleet = fit.fleet
        if fleet is None or not fleet.names:
            return None
        white, residual, rows = _projected(fit)
        root = np.linalg.cholesky(fleet.covariance)
        basis, sizes, right = np.linalg.svd(white @ root, full_matrices=False)
        kept = sizes > _SEEN * sizes[0]
        basis, sizes, right = basis[:, kept], sizes[kept], right[kept]
        seen, freedom = basis.T @ residual, rows - int(kept.sum())
        rest = max(float(residual @ residual - seen @ seen), 0.0) if freedom > 0 else 0.0
        found = _Comparison.of(seen[None], np.array([rest]), sizes**2, max(freedom, 0))
        rng = np.random.default_rng(0)
        drawn = _drawn(fleet, rng) @ white.T @ basis + rng.standard_normal((_DRAWS, len(sizes)))
        left = rng.chisquare(freedom, _DRAWS) if freedom > 0 else np.zeros(_DRAWS)
        others = _Comparison.of(drawn, left, sizes**2, max(freedom, 0))
        probability = float((np.sum(others.ratio >= found.ratio[0]) + 1) / (_DRAWS + 1))
        size, noise = found.size[0], found.noise[0]
        shift = root @ right.T @ (size**2 * sizes / (noise + size**2 * sizes**2) * seen)
        relative = shift / np.sqrt(np.diag(fleet.covariance))
        order = [k for k in np.argsort(-np.abs(relative)) if abs(relative[k]) > _NAMED]
        shifts = tuple((fleet.names[k], float(relative[k])) for k in order[:_LISTED])
        return cls(float(size), probability, shifts, len(order))


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Twice the logarithm of the likelihood ratio (k,), the size φ (k,) and the variance s² (k,) at the maximum."""

    ratio: np.ndarray
    size: np.ndarray
    noise: np.ndarray

    @classmethod
    def of(cls, seen: np.ndarray, rest: np.ndarray, variances: np.ndarray, freedom: int) -> _Comparison:
        """Of k sets of coordinates `seen` (k, r) with prior `variances` (r,), and sums of squares `rest` (k,) off them."""
        squares = seen**2
        value = np.empty((len(_SIZES), len(_NOISES), len(seen)))
        for i, size in enumerate(_SIZES):
            total = _NOISES[:, None] + size * variances
            value[i] = -np.log(total).sum(axis=1)[:, None] - (1 / total) @ squares.T
        value -= freedom * np.log(_NOISES)[None, :, None] + rest / _NOISES[None, :, None]
        best = value.max(axis=1)
        chosen = best.argmax(axis=0)
        noise = _NOISES[value.argmax(axis=1)[chosen, range(len(seen))]]
        return cls(best.max(axis=0) - best[0], np.sqrt(_SIZES[chosen]), noise)


def _drawn(fleet: FleetPrior, rng: np.random.Generator) -> np.ndarray:
    """Deviations (draws, p) from the prior's mean of robots of the model."""
    mean = rng.standard_normal((_DRAWS, len(fleet.names))) @ np.linalg.cholesky(fleet.uncertainty).T
    return mean + individuals(fleet.spread, fleet.freedom, _DRAWS, rng)


def _projected(fit: GeometricFit) -> tuple[np.ndarray, np.ndarray, int]:
    """Columns (m, p) of the prior's parameters and residual (m,) about its mean, whitened, off all parameters without such a prior, and the
    number of readings less the rank of these.
    """
    fleet, linear, scatter = fit.fleet, fit.linear, fit.scatter
    assert fleet is not None
    inside = ~np.isin(np.arange(len(fit.poses)), fit.estimate.outliers)
    at = predict_measurements(
        fit.model, fit.poses, flank=fit.flank, elastic=bool(fit.model.elastic), jacobians=True
    )
    rows = inside[at.readings.row]
    whitening = scatter.whitening(linear.readings, linear.turns)
    own = at.jacobian(fleet.names)[rows]
    moved = fit.estimate.parameters.subset(fleet.names).coordinates() - fleet.mean
    residual = at.residual[rows] + own @ moved
    elastic = fit.prior.parameters
    tied = []
    if len(elastic):
        fitted = fit.estimate.parameters.subset(elastic.names)
        slopes = at.jacobian(elastic.names)[rows] * fitted.natural_slope(fitted.coordinates())
        values, vectors = np.linalg.eigh(fit.prior.covariance)
        tied.append(slopes @ (vectors * np.sqrt(np.maximum(values, 0.0))))
        residual = residual + slopes @ (fitted.coordinates() - elastic.prior_mean())
    if linear.waves.size and getattr(scatter, TRANSMISSION) > 0:
        tied.append(linear.waves * getattr(scatter, TRANSMISSION))
        names = [n for n in fit.estimate.parameters.names if ".transmission_" in n]
        residual = residual + at.jacobian(names)[rows] @ np.array([fit.estimate.values[n] for n in names])
    there = linear.readings.present.ravel()
    flat = [whitening(part).reshape(there.size, -1)[there] for part in (linear.free, own, *tied)]
    left = whitening(residual)[there]
    white = np.column_stack([flat[1], left])
    if tied:
        # W = 1 - Q diag(1 - (1 + s²)⁻¹ᐟ²) Qᵀ whitens 1 + B Bᵀ
        basis, sizes, _ = np.linalg.svd(np.column_stack(flat[2:]), full_matrices=False)
        lost = 1 - 1 / np.sqrt(1 + sizes**2)
        white = white - basis @ (lost[:, None] * (basis.T @ white))
        flat[0] = flat[0] - basis @ (lost[:, None] * (basis.T @ flat[0]))
    free, sizes, _ = np.linalg.svd(flat[0], full_matrices=False)
    free = free[:, sizes > _SEEN * sizes.max(initial=0.0)]
    white = white - free @ (free.T @ white)
    return np.ascontiguousarray(white[:, :-1]), white[:, -1], len(white) - free.shape[1]
