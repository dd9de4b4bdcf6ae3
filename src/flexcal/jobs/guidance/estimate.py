"""Most probable geometry after the rows so far, with its uncertainty: a Gaussian prior of plausible sizes and the measured points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.jobs.guidance.unknowns import Unknowns
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

ROBOT_STD = 0.03 * MILLIMETRE
"""Expected scatter of a coordinate by the robot itself, m, before the residuals tell."""
_FREEDOM = 6.0
"""Degrees of freedom with which the expected scatter counts."""
_PRIOR_FREEDOM, _PRIOR_SCALE = 10.0, 1.5
"""Degrees of freedom with which the geometric errors are expected to be so many times their plausible sizes."""
_STEPS = 4
_ROUNDS = 6
_CONVERGED = 1e-3
"""Largest step, in units of the prior, at which the linearisation point is kept."""


@dataclass(frozen=True, eq=False)
class SessionEstimate:
    """Estimate from N rows, linearised at its solution.

    `model` has the estimated parameters, `present` (p,) in units of the prior; `change` (p,) is what is estimated beside them, to first
    order, and `covariance` (p, p) that of the errors.
    `residual` (N, 3), m, is measured minus predicted, `jacobian` (N, 3, p). `std` (N,), m, is the expected standard deviation of a
    coordinate of every row, `scale` times the one stated; the scale has `freedom` degrees of freedom. `prior_scale` is by how much the
    geometric errors exceed their plausible sizes.
    """

    model: RobotModel
    rows: PoseSet
    unknowns: Unknowns
    present: np.ndarray
    change: np.ndarray
    covariance: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    std: np.ndarray
    scale: float
    freedom: float
    prior_scale: float

    @classmethod
    def of(
        cls,
        start: RobotModel,
        rows: PoseSet,
        unknowns: Unknowns,
        *,
        near: SessionEstimate | None = None,
        further: np.ndarray | None = None,
    ) -> SessionEstimate:
        """Estimate from rows of a registered robot `start`, by Gauss-Newton steps.

        `near` is an estimate from nearly the same rows, from which to start; `further` (N, 3, k), m, are columns of disturbances of the
        rows in units of their own priors, such as a motion of the instrument, which are estimated too and are the last k values.
        """
        size = len(unknowns)
        stated = np.hypot(np.sqrt((rows.sigma**2).mean(axis=1)), ROBOT_STD)
        weight = np.repeat(1 / stated, 3)
        model, present, scale, prior_scale = start, np.zeros(size), 1.0, 1.0
        if near is not None:
            model, present = near.model, near.present
            scale, prior_scale = near.scale, near.prior_scale
        steps = 0
        while True:
            position, jacobian = unknowns.columns(model, rows)
            if further is not None:
                jacobian = np.concatenate([jacobian, further], axis=2)
            there = np.concatenate([present, np.zeros(jacobian.shape[2] - size)])
            left = rows.position - position
            flat = jacobian.reshape(len(weight), -1) * weight[:, None]
            solved = _scaled_solution(flat, left.ravel() * weight, there, scale, prior_scale)
            change, covariance, scale, prior_scale, freedom = solved
            step, steps = unknowns.within_reach(present + change[:size]) - present, steps + 1
            if np.abs(step).max(initial=0.0) < _CONVERGED or steps == _STEPS:
                break
            model, present = unknowns.moved(model, step), present + step
        residual = left - jacobian @ change
        return cls(
            model, rows, unknowns, present, change, covariance, residual, jacobian, scale * stated,
            scale, freedom, prior_scale,
        )  # fmt: skip

    @property
    def geometry_covariance(self) -> np.ndarray:
        """Covariance (p, p) of the robot's parameters, without disturbances."""
        size = len(self.unknowns)
        return self.covariance[:size, :size]

    @property
    def spread(self) -> np.ndarray:
        """Covariance (N, 3, 3), m², of the residuals about zero: noise less what the fit took."""
        own = self.jacobian @ self.covariance @ np.swapaxes(self.jacobian, 1, 2)
        return self.std[:, None, None] ** 2 * np.eye(3) - own

    def predicted(self, rows: PoseSet) -> tuple[np.ndarray, np.ndarray]:
        """Points (M, 3), m, predicted for other rows, and covariance (M, 3, 3), m², of the error by what is not known of the robot."""
        position, columns = self.unknowns.columns(self.model, rows)
        own = self.change[: len(self.unknowns)]
        return position + columns @ own, columns @ self.geometry_covariance @ np.swapaxes(columns, 1, 2)

    def expected_std(self, rows: PoseSet) -> np.ndarray:
        """Standard deviation (M,), m, of a coordinate of other rows by instrument and robot."""
        return self.scale * np.hypot(np.sqrt((rows.sigma**2).mean(axis=1)), ROBOT_STD)

    @property
    def robot_std(self) -> float:
        """Scatter of a coordinate, m, that the instrument's stated noise does not explain: of the robot and of the model's form.

        Where no noise is stated, that of the instrument too.
        """
        if not self.rows.sigma_given:
            return float(np.median(self.std))
        return float(np.sqrt(max(self._excess, 0.0)))

    @property
    def instrument_share(self) -> float:
        """Ratio of the instrument's noise to the stated one: one or less, and zero where none is stated."""
        if not self.rows.sigma_given:
            return 0.0
        stated = float(np.median((self.rows.sigma**2).mean(axis=1)))
        return float(np.sqrt(1 + min(self._excess, 0.0) / stated))

    @property
    def _excess(self) -> float:
        """Variance of a coordinate, m², beyond that of the instrument; negative where it is less noisy than stated."""
        return float(np.median(self.std**2 - (self.rows.sigma**2).mean(axis=1)))


def _scaled_solution(
    jacobian: np.ndarray, left: np.ndarray, present: np.ndarray, scale: float, prior_scale: float
) -> tuple[np.ndarray, np.ndarray, float, float, float]:
    """Change and covariance of the values, scale of the noise and of the prior by their evidence (MacKay 1992), degrees of freedom."""
    size, normal, product = len(present), jacobian.T @ jacobian, jacobian.T @ left
    rounds = 0
    while True:
        information = normal / scale**2 + np.eye(size) / prior_scale**2
        covariance = np.linalg.inv(information)
        change = covariance @ (product / scale**2 - present / prior_scale**2)
        determined = size - np.trace(covariance) / prior_scale**2
        squares = float(np.sum((left - jacobian @ change) ** 2))
        freedom = _FREEDOM + max(len(left) - determined, 0.0)
        before, rounds = (scale, prior_scale), rounds + 1
        scale = float(np.sqrt((_FREEDOM + squares) / freedom))
        value = present + change
        expected = _PRIOR_FREEDOM * _PRIOR_SCALE**2
        prior_scale = float(np.sqrt(max(1.0, (value @ value + expected) / (determined + _PRIOR_FREEDOM))))
        if np.allclose(before, (scale, prior_scale), rtol=1e-3) or rounds == _ROUNDS:
            return change, covariance, scale, prior_scale, float(freedom)
