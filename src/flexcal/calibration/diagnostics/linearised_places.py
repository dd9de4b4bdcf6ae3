"""Fit of a ball in sockets, linearised at its solution, from which some places or poses are left out at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.error_model import joint_rotation_jacobian
from flexcal.calibration.fit import GeometricFit, manufacturing_tolerances
from flexcal.calibration.measurement import predict_measurements


@dataclass(frozen=True, eq=False)
class LinearisedPlaces:
    """Linear fit of p parameters, in units of `scale` (p,), to R readings, about the solution of `fit`.

    `columns` (R, 3, p) are derivatives of the readings, `white` (R, 3, p) and `left` (R, 3) those and the residuals in standard
    deviations of their errors; `known` (p,) parameters with a prior, which differ from it by `expected` standard deviations;
    `inside` (R,) readings that are no outliers.
    """

    fit: GeometricFit
    names: tuple[str, ...]
    scale: np.ndarray
    columns: np.ndarray
    white: np.ndarray
    left: np.ndarray
    known: np.ndarray
    expected: np.ndarray
    inside: np.ndarray
    present: np.ndarray
    row: np.ndarray

    @classmethod
    def of(cls, fit: GeometricFit) -> LinearisedPlaces:
        """Linearisation of a fit. Stiffness and inertia keep their estimates, as the error model does."""
        poses, model, estimate = fit.poses, fit.model, fit.estimate
        at = predict_measurements(model, poses, flank=fit.flank, elastic=bool(model.elastic), jacobians=True)
        held = [item.name for item in fit.undetermined]
        names = [name for name in fit.identifiability.kept_names if name not in held]
        names += [p.name for p in estimate.parameters if _is_random(p.name, fit)]
        deviation = np.array([_prior_std(name, fit) for name in names])
        known = np.isfinite(deviation)
        fitted = estimate.parameters.subset(names)
        scale = np.where(known, deviation, manufacturing_tolerances(fitted))
        columns = at.jacobian(names) * scale
        readings = at.readings
        whitening = fit.scatter.weights(readings, joint_rotation_jacobian(at))
        return cls(
            fit,
            tuple(names),
            scale,
            columns,
            whitening(columns).reshape(-1, 3, len(names)),
            whitening(fit.readings).reshape(-1, 3),
            known,
            (fitted.prior_mean() - fitted.coordinates()) / scale,
            ~np.isin(readings.row, estimate.outliers),
            readings.present,
            readings.row,
        )

    def rows_of(self, place: str) -> np.ndarray:
        """Indices (N,) of the poses at a place of the fixture."""
        poses = self.fit.poses
        return np.flatnonzero(poses.in_socket & (poses.station == place))

    def ball(self, place: str, change: np.ndarray) -> np.ndarray:
        """Positions (N, 3), m, of the ball at a place, in its fixture, with a `change` (p,) of the parameters; the place itself stays."""
        own = self.rows_of(place)
        moved = np.where([name.startswith(f"station.{place}.") for name in self.names], 0.0, change)
        return self.fit.poses.position[own] - (self.fit.residuals[own] - self.columns[own] @ moved)

    def normal_equations(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Matrix (p, p) and right-hand side (p,) of the poses with these indices, without outliers and priors."""
        seen = self.present & (self.inside & np.isin(self.row, rows))[:, None]
        table = self.white[seen]
        return table.T @ table, table.T @ self.left[seen]

    def solved(self, rows: np.ndarray) -> tuple[np.ndarray, float, int]:
        """Change (p,) of the parameters in a fit to the readings marked in `rows` (R,), the squares that it leaves, and its degrees of
        freedom.
        """
        measured = self.present & rows[:, None]
        table = np.concatenate([self.white[measured], np.eye(len(self.names))[self.known]])
        right = np.concatenate([self.left[measured], self.expected[self.known]])
        change, _, rank, _ = np.linalg.lstsq(table, right, rcond=1e-10)
        return change, float(np.sum((right - table @ change) ** 2)), len(right) - int(rank)


def _is_random(name: str, fit: GeometricFit) -> bool:
    """Whether a parameter is a wave of the random effects `transmission`."""
    return ".transmission_" in name and name not in fit.identifiability.names


def _prior_std(name: str, fit: GeometricFit) -> float:
    """Standard deviation of a parameter beforehand; infinite without one."""
    if _is_random(name, fit):
        return fit.scatter.transmission / int(name.split("_")[-2])
    return fit.estimate.parameters[name].prior_std
