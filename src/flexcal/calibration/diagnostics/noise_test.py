"""Test of the stated noise of every instrument against the residuals of a fit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.error_model import Whitening
from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.measurement import predict_measurements
from flexcal.estimation import RANK_TOLERANCE

_CHANCE = 0.01
"""Significance level at which a stated noise is contradicted."""
_NEAR = 1.2
"""Factor up to which a stated noise counts as right even where many readings tell the difference."""
_FEWEST = 5
"""Least degrees of freedom for a judgement."""
_OWN = 10.0
"""Factor on noise relative to the robot's reach, by which what is left of a column may be the residuals themselves."""
ORIENTATIONS, POINTS = "orientations", "points"


@dataclass(frozen=True)
class StatedNoise:
    """Noise stated of one instrument, or of all together, and what the residuals say of it.

    `name` is that of the instrument under `measurements:` of robot.yaml, "points" or "orientations", or empty for all together;
    `readings` the number of coordinates, `freedom` their degrees of freedom. `chi2` is the reduced chi-square, whose expectation is one
    where the stated noise is all that the readings have.
    """

    name: str
    readings: int
    freedom: float
    chi2: float

    @property
    def factor(self) -> float:
        """Noise of the readings over what is stated of it."""
        return float(np.sqrt(self.chi2))

    @property
    def probability(self) -> float:
        """Two-sided p-value of the stated noise."""
        from scipy.special import gammainc, gammaincc

        shape, statistic = self.freedom / 2, self.chi2 * self.freedom / 2
        return float(min(1.0, 2 * min(gammainc(shape, statistic), gammaincc(shape, statistic))))

    @property
    def contradicted(self) -> bool:
        """Whether the readings scatter significantly more or less than is stated, p < 1 %, and by more than a fifth."""
        return self.probability < _CHANCE and not 1 / _NEAR < self.factor < _NEAR

    def document(self) -> dict[str, float | int | str | None]:
        """Block of a JSON document; `instrument` is null for all together."""
        return {
            "instrument": self.name or None,
            "readings": self.readings,
            "degrees_of_freedom": self.freedom,
            "reduced_chi2": self.chi2,
            "p": self.probability,
        }


def stated_noise(fit: GeometricFit) -> tuple[StatedNoise, ...]:
    """Test of the stated noise of all instruments together, then of each where there are several; empty where none is stated.

    The readings are whitened by their stated covariance alone, without the estimated components of the scatter, and projected off all
    columns of the fit, fitted and held parameters alike, so that no prior matters. The squared length of what is left has a chi-square
    distribution whose degrees of freedom are the number of readings less the rank of the columns. Of several instruments each has its own
    variance factor, estimated jointly (Helmert 1907; MINQUE of Rao 1971), so that one instrument with a wrong sigma does not accuse the
    others.
    """
    whitened = _whitened(fit)
    if whitened is None:
        return ()
    rows, free, held, names = whitened
    basis = _basis(free, RANK_TOLERANCE)
    # where nothing tells the size of the robot, what is left of a common scale of all lengths is the residuals themselves
    own = _OWN * float(np.median(fit.poses.sigma[fit.poses.stated])) / fit.model.reach
    basis = np.concatenate([basis, _basis(held, max(RANK_TOLERANCE, own), beside=basis)], axis=1)
    left = rows - basis @ (basis.T @ rows)
    freedom = len(rows) - basis.shape[1]
    if freedom < _FEWEST:
        return ()
    whole = StatedNoise("", len(rows), float(freedom), float(left @ left) / freedom)
    groups = {name: names == name for name in dict.fromkeys(names.tolist())}
    return (whole, *_of_each(groups, left, basis)) if len(groups) > 1 else (whole,)


def _basis(columns: np.ndarray, tolerance: float, beside: np.ndarray | None = None) -> np.ndarray:
    """Orthonormal basis (n, r) of columns (n, k) of unit norm, without what is in the span of the basis `beside` (n, m)."""
    scale = np.linalg.norm(columns, axis=0)
    scaled = columns[:, scale > 0] / scale[scale > 0]
    if beside is not None:
        for _ in range(2):
            scaled = scaled - beside @ (beside.T @ scaled)
    basis, sizes, _ = np.linalg.svd(scaled, full_matrices=False)
    return basis[:, sizes > tolerance * (1.0 if beside is not None else sizes.max(initial=0.0))]


def _of_each(groups: dict[str, np.ndarray], left: np.ndarray, basis: np.ndarray) -> Iterator[StatedNoise]:
    """Variance factor of every group of readings, from their residuals `left` (n,) off an orthonormal `basis` (n, k)."""
    taken = [basis[own].T @ basis[own] for own in groups.values()]
    crossed = np.array([[np.sum(a * b) for b in taken] for a in taken])
    count = np.array([own.sum() for own in groups.values()])
    crossed += np.diag(count - 2 * np.array([np.trace(own) for own in taken]))
    squares = np.array([left[own] @ left[own] for own in groups.values()])
    if np.linalg.cond(crossed) > 1 / RANK_TOLERANCE:
        return
    inverse = np.linalg.inv(crossed)
    for name, size, factor, spread in zip(groups, count, inverse @ squares, np.diag(inverse), strict=True):
        if 1 / spread >= _FEWEST:
            yield StatedNoise(name, int(size), float(1 / spread), max(float(factor), 0.0))


def _whitened(fit: GeometricFit) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
    """Residuals (n,) of the coordinates whose noise is stated, columns (n, k) of free parameters and of held ones, and names (n,) of
    instruments; None where there are none.
    """
    linear, poses = fit.linear, fit.poses
    readings = linear.readings
    stated = readings.present & (readings.sigma > 0)
    if not poses.sigma_given or not stated.any():
        return None
    columns = [linear.tied]
    if fit.scatter.transmission > 0:
        columns.append(linear.waves)
    if fit.undetermined:
        at = predict_measurements(fit.model, poses, flank=fit.flank, jacobians=True)
        held = at.jacobian([item.name for item in fit.undetermined])
        kept = ~np.isin(at.readings.row, fit.estimate.outliers)
        columns.append(held[kept])
    variances = readings.blocks + np.where(stated, 0.0, 1.0)[:, :, None] * np.eye(3)
    whitening = Whitening.of(variances, readings.across, readings.beside)
    there = stated.ravel()
    instrument = np.where(poses.far | ~poses.located, poses.station, POINTS).astype(object)
    if poses.camera is not None:
        instrument = np.where(poses.seen, poses.camera, instrument)
    names = np.where(readings.points | poses.seen[readings.row], instrument[readings.row], ORIENTATIONS)
    held = np.concatenate(columns, axis=2)
    return (
        whitening(linear.residual)[there],
        whitening(linear.free)[there],
        whitening(held)[there],
        np.repeat(names, 3)[there],
    )
