"""Whether a robot is of the model whose prior its calibration had."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.error_model import TRANSMISSION
from flexcal.calibration.fit import FleetPrior, GeometricFit, plausible_size
from flexcal.calibration.measurement import predict_measurements
from flexcal.estimation import individuals

_DRAWS = 800
"""Robots of the model that are drawn for comparison."""
CONTRADICTED = 0.01
"""Probability below which the prior does not fit the robot."""
_SIZES = np.geomspace(1.0, 1e5, 40)
"""Squared sizes of the deviation from the prior's mean that are tried, relative to the prior's."""
_NOISES = np.geomspace(1e-5, 1e3, 80)
"""Variances of the errors of the measurements that are tried, relative to those of the fit."""
_WAVES = np.array([0.0, *np.geomspace(1e-5, 1.0, 21)])
"""Standard deviations, rad, of the waves of transmission errors that are tried, over that of the errors of the measurements relative to
the fit's.
"""
_SEEN = 1e-9
_SAME = 1e-6
"""One less the cosine between the effects of two parameters below which they are one, as lengths along parallel axes."""
_NAMED = 3.0
"""Deviation, in standard deviations of the prior, from which a parameter is named."""
_LISTED = 3
_UNLIKELY = 6.6
"""Twice the logarithm of a likelihood ratio, 1 % of chi-square with one degree of freedom, from which another parameter is off."""


@dataclass(frozen=True)
class FleetConflict:
    """Test of a prior from other robots: this one deviates from them `size` times as much as they do from each other, or in one parameter.

    `probability` is that of likelihood ratios as large where it is one of them. `shifts` (name, deviation in standard deviations of the
    prior) say where it deviates, the farthest first, and `deviating` in how many parameters by more than three; where one parameter alone
    explains it better, `alone`, they are the parameters that may be this one, zeros first, in standard deviations given the others,
    one of those with the same effect, a zero if there is one.
    """

    size: float
    probability: float
    shifts: tuple[tuple[str, float], ...]
    deviating: int
    alone: bool

    @property
    def contradicted(self) -> bool:
        """Whether the prior does not fit the robot."""
        return self.probability < CONTRADICTED

    @property
    def single(self) -> dict[str, float]:
        """Deviations of the parameters one of which alone may be off; empty where none is, or too many may be."""
        listed = self.contradicted and self.alone and self.deviating == len(self.shifts)
        return dict(self.shifts) if listed else {}

    def document(self) -> dict[str, Any]:
        """Entry of results.json."""
        return {
            "size": self.size,
            "probability": self.probability,
            "contradicted": self.contradicted,
            "shifts": dict(self.shifts),
            "deviating": self.deviating,
            "alone": self.alone,
        }

    @classmethod
    def of(cls, fit: GeometricFit) -> FleetConflict | None:
        """Test of the prior of a fit, linearised at its solution; None for a fit without one.

        What the measurements say of the robot is compared with the prior by the likelihood of variances, after projection off all other
        parameters: s² times the errors' variance, ω² that of the waves of transmission errors and φ² times the prior's covariance. Two
        maxima are compared with that over s and ω at φ = 1: over φ ≥ 1, s and ω, for a robot that is off in many parameters, and over s,
        ω and the value of a parameter, for one that is off in this one. The errors need not be known: directions in which the prior is
        sharper than the measurements tell s. Large waves imitate parameters that are off, so ω has a half-normal prior of their plausible
        size. The distribution of the ratios is that of robots drawn from the prior, whose spread is known with few degrees of freedom where
        it is from few robots, with the s and ω of this one at φ = 1; the smaller p-value counts twice.
        """
        fleet = fit.fleet
        if fleet is None or not fleet.names:
            return None
        own, waves, residual, rows = _projected(fit)
        root = np.linalg.cholesky(fleet.covariance)
        basis, sizes, _ = np.linalg.svd(np.column_stack([own @ root, waves]), full_matrices=False)
        basis = basis[:, sizes > _SEEN * sizes[0]]
        own, waves, seen = basis.T @ own, basis.T @ waves, basis.T @ residual
        freedom = max(rows - basis.shape[1], 0)
        rest = max(float(residual @ residual - seen @ seen), 0.0) if freedom else 0.0
        plausible = plausible_size(fit.model, f"{fit.model.motor_joints[0].name}.{TRANSMISSION}_1_sin")
        spaces = [_Whitened.of(own, root, waves, size) for size in (_WAVES if waves.size else _WAVES[:1])]
        found = _Comparison.of(spaces, seen[None], np.array([rest]), freedom, plausible)
        wave, noise = found.usual
        rng = np.random.default_rng(0)
        errors = rng.standard_normal((_DRAWS, len(seen)))
        errors += wave * rng.standard_normal((_DRAWS, waves.shape[1])) @ waves.T
        drawn = _drawn(fleet, rng) @ own.T + np.sqrt(noise) * errors
        left = noise * rng.chisquare(freedom, _DRAWS) if freedom else np.zeros(_DRAWS)
        others = _Comparison.of(spaces, drawn, left, freedom, plausible)
        larger = (
            np.sum(others.ratio >= found.ratio[0]),
            np.sum(others.ratios.max(axis=0) >= found.ratios[:, 0].max()),
        )
        probability = min(1.0, 2 * float(min(larger) + 1) / (_DRAWS + 1))
        stds = np.sqrt(np.diag(fleet.covariance))
        alone = bool(found.ratios[:, 0].max() > found.ratio[0])
        if alone:
            relative = found.shifts[:, 0] * np.sqrt(np.diag(np.linalg.inv(fleet.covariance)))
            order = [
                k
                for k in np.argsort(-found.ratios[:, 0])
                if found.ratios[k, 0] > found.ratios[:, 0].max() - _UNLIKELY
            ]
            order = _different(own, sorted(order, key=lambda k: not fleet.names[k].endswith(".offset")))
        else:
            size, noise, best = found.size[0], found.noise[0], spaces[found.space[0]]
            inside = best.coordinates(seen[None])[0][0]
            shift = best.sizes * size**2 / (noise + size**2 * best.sizes**2) * inside
            relative = root @ best.right.T @ shift / stds
            order = [k for k in np.argsort(-np.abs(relative)) if abs(relative[k]) > _NAMED]
        shifts = tuple((fleet.names[k], float(relative[k])) for k in order[:_LISTED])
        return cls(float(found.size[0]), probability, shifts, len(order), alone)


def _different(columns: np.ndarray, order: Sequence[int]) -> list[int]:
    """Those of columns (d, p) in this `order` whose effect is not that of one before."""
    units = columns / np.linalg.norm(columns, axis=0)
    found: list[int] = []
    for k in order:
        if all(abs(float(units[:, k] @ units[:, j])) < 1 - _SAME for j in found):
            found.append(k)
    return found


@dataclass(frozen=True, eq=False)
class _Whitened:
    """Singular vectors of the prior's columns, whitened under waves of the size `wave`, rad: V = 1 + `wave`² B Bᵀ = L Lᵀ of waves B.

    `inverse` (d, d) is L⁻¹, `logarithm` that of the determinant of V; `basis` (d, r), `sizes` (r,) and `right` (r, p) are those of L⁻¹ A R,
    `columns` (r, p) are L⁻¹ A in this basis.
    """

    wave: float
    inverse: np.ndarray
    logarithm: float
    basis: np.ndarray
    sizes: np.ndarray
    right: np.ndarray
    columns: np.ndarray

    @classmethod
    def of(cls, own: np.ndarray, root: np.ndarray, waves: np.ndarray, wave: float) -> _Whitened:
        """Of columns A (d, p) of the prior, whose covariance is R Rᵀ, and B (d, w) of the waves."""
        lower = np.linalg.cholesky(np.eye(len(own)) + wave**2 * waves @ waves.T)
        inverse = np.linalg.inv(lower)
        basis, sizes, right = np.linalg.svd(inverse @ own @ root, full_matrices=False)
        logarithm = 2 * float(np.log(np.diag(lower)).sum())
        return cls(wave, inverse, logarithm, basis, sizes, right, basis.T @ inverse @ own)

    def coordinates(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates (k, r) of `rows` (k, d) in the basis, and the sums of squares (k,) off it."""
        white = rows @ self.inverse.T
        seen = white @ self.basis
        return seen, np.maximum((white**2).sum(axis=1) - (seen**2).sum(axis=1), 0.0)


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Twice the logarithms of the likelihood ratios of k robots: `ratio` (k,) of a size φ, and where it is largest the `size` (k,), the
    variance s² `noise` (k,) and the number `space` (k,) of the waves' size; `ratios` (p, k) of single parameters, and their `shifts` (p, k)
    there; `usual` are the waves' relative size and s² of the first robot at φ = 1.
    """

    ratio: np.ndarray
    size: np.ndarray
    noise: np.ndarray
    space: np.ndarray
    ratios: np.ndarray
    shifts: np.ndarray
    usual: tuple[float, float]

    @classmethod
    def of(
        cls, spaces: Sequence[_Whitened], rows: np.ndarray, rest: np.ndarray, freedom: int, plausible: float
    ) -> _Comparison:
        """Of k sets of coordinates `rows` (k, d), and sums of squares `rest` (k,) off them with `freedom`; waves are `plausible` rad."""
        every, count = np.arange(len(rows)), spaces[0].columns.shape[1]
        best, usual, first = np.full(len(rows), -np.inf), np.full(len(rows), -np.inf), (0.0, 1.0)
        size, noise, space = np.ones(len(rows)), np.ones(len(rows)), np.zeros(len(rows), dtype=int)
        single, shifts = np.full((count, len(rows)), -np.inf), np.zeros((count, len(rows)))
        for k, own in enumerate(spaces):
            seen, off = own.coordinates(rows)
            squares, variances = seen**2, own.sizes**2
            errors = (freedom + len(own.inverse) - len(variances)) * np.log(_NOISES) + own.logarithm
            errors = (errors + (own.wave / plausible) ** 2 * _NOISES)[:, None]
            errors = errors + (off + rest) / _NOISES[:, None]
            value = np.empty((len(_SIZES), len(_NOISES), len(rows)))
            for i, tried in enumerate(_SIZES):
                total = _NOISES[:, None] + tried * variances
                value[i] = -np.log(total).sum(axis=1)[:, None] - (1 / total) @ squares.T - errors
            alike = value[0]
            if (highest := alike.max(axis=0))[0] > usual[0]:
                first = (own.wave, float(_NOISES[alike[:, 0].argmax()]))
            usual = np.maximum(usual, highest)
            largest = value.max(axis=1)
            chosen = largest.argmax(axis=0)
            better = largest[chosen, every] > best
            best = np.where(better, largest[chosen, every], best)
            size = np.where(better, np.sqrt(_SIZES[chosen]), size)
            noise = np.where(better, _NOISES[value[chosen, :, every].argmax(axis=1)], noise)
            space = np.where(better, k, space)
            weights = 1 / (_NOISES[:, None] + variances)
            for j, column in enumerate(own.columns.T):
                along, told = (weights * column) @ seen.T, (weights @ column**2)[:, None]
                value_alone = alike + along**2 / told
                at = value_alone.argmax(axis=0)
                better = value_alone[at, every] > single[j]
                single[j] = np.where(better, value_alone[at, every], single[j])
                shifts[j] = np.where(better, along[at, every] / told[at, 0], shifts[j])
        return cls(best - usual, size, noise, space, single - usual, shifts, first)


def _drawn(fleet: FleetPrior, rng: np.random.Generator) -> np.ndarray:
    """Deviations (draws, p) from the prior's mean of robots of the model."""
    mean = rng.standard_normal((_DRAWS, len(fleet.names))) @ np.linalg.cholesky(fleet.uncertainty).T
    return mean + individuals(fleet.spread, fleet.freedom, _DRAWS, rng)


def _projected(fit: GeometricFit) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Columns (m, p) of the prior's parameters and (m, w) of waves of transmission errors, and residual (m,) about the prior's mean without
    waves, whitened, off all parameters without such a prior, and the number of readings less the rank of these.
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
    if getattr(scatter, TRANSMISSION) > 0:
        names = [n for n in fit.estimate.parameters.names if ".transmission_" in n]
        residual = residual + at.jacobian(names)[rows] @ np.array([fit.estimate.values[n] for n in names])
    there = linear.readings.present.ravel()
    flat = [
        whitening(part).reshape(there.size, -1)[there] for part in (linear.free, own, linear.waves, *tied)
    ]
    left = whitening(residual)[there]
    white = np.column_stack([*flat[1:3], left])
    if tied:
        # W = 1 - Q diag(1 - (1 + s²)⁻¹ᐟ²) Qᵀ whitens 1 + B Bᵀ
        basis, sizes, _ = np.linalg.svd(np.column_stack(flat[3:]), full_matrices=False)
        lost = 1 - 1 / np.sqrt(1 + sizes**2)
        white = white - basis @ (lost[:, None] * (basis.T @ white))
        flat[0] = flat[0] - basis @ (lost[:, None] * (basis.T @ flat[0]))
    free, sizes, _ = np.linalg.svd(flat[0], full_matrices=False)
    free = free[:, sizes > _SEEN * sizes.max(initial=0.0)]
    white = white - free @ (free.T @ white)
    count = len(fleet.names)
    return white[:, :count], white[:, count:-1], white[:, -1], len(white) - free.shape[1]
