"""Score test for points that were read at another instant than the joint positions, while the robot moved."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.diagnostics.further_columns import columns_of_points
from flexcal.calibration.diagnostics.lag import Lag, measuring_times
from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.model.robot import RobotModel

_SMOOTH = 0.1
"""Largest square of what rows of a path are off the curve through those about them, relative to that of steps between rows."""
_STENCIL, _SHORT = 5, 3
"""Rows for a derivative, and for one from which its error is told."""
_STEP = 1e-3
"""Finite difference of the velocity of the points, in time steps."""


@dataclass(frozen=True)
class ReadingLag(Lag):
    """Points lag the joint positions; its rival is friction or wind-up of every joint, which go with the direction of its motion.

    Below half of the residuals that of a robot that stands still may be what goes with it.
    """

    least_share = 0.5
    rows = "steps"

    @classmethod
    def of(cls, fit: GeometricFit) -> ReadingLag | None:
        """First-order estimate with one further parameter of a fit, by the velocity along the rows; None where they are no path, or no
        points.

        Rows are in measuring order, at the times of the file where it has them. Poses that were chosen one by one are no path: then
        nothing tells how the robot moved.
        """
        poses = fit.poses
        if fit.linear.readings.slopes is not None:
            return None
        found = _effects(fit.model, poses)
        if found is None:
            return None
        effects, timed = found
        products = fit.linear.products_in_time(fit.scatter, columns_of_points(fit, effects))
        return cls._by(products, fit.linear.freedom - 1, timed, 1.0)

    @classmethod
    def of_errors(cls, model: RobotModel, poses: PoseSet, errors: np.ndarray) -> ReadingLag | None:
        """The same of `errors` (N, 3), m, of a calibrated robot at points to which nothing was fitted, all weighted alike."""
        found = _effects(model, poses)
        if found is None:
            return None
        effects, timed = found
        columns = np.column_stack([effects.reshape(-1, effects.shape[2]), errors.ravel()])
        return cls._by(columns.T @ columns, errors.size - 1, timed, 0.0)

    @classmethod
    def _by(cls, products: np.ndarray, freedom: int, timed: bool, least: float) -> ReadingLag | None:
        """By scalar products of the effect of a lag, the same by fewer rows, those of reversals and, last, the residuals, whose variance is
        `least` or larger.
        """
        found = cls.by_products(products, slice(2, -1), freedom, timed, least)
        if found is None or found.lag == 0 or products[1, 1] <= 0:
            return found
        # the errors of derivatives by three and five rows are of second and fourth order in the step
        bent = (products[1, -1] / products[1, 1] / found.lag - 1) ** 2
        return replace(found, std=float(np.hypot(found.std, bent * found.lag)))


def _effects(model: RobotModel, poses: PoseSet) -> tuple[np.ndarray, bool] | None:
    """Changes (N, 3, 2 + n) of the points with a lag, by five and by three rows, and with reversals, and whether by times of the file.

    None where the rows are no path.
    """
    if not poses.located.all() or len(poses) <= 2 * _STENCIL:
        return None
    times, timed = measuring_times(poses)
    if not _is_path(poses.q, times):
        return None
    rate = _rates(poses.q, times, _STENCIL)
    velocities = [_velocity(model, poses, rate), _velocity(model, poses, _rates(poses.q, times, _SHORT))]
    return np.stack([*velocities, *_reversals(model, poses, rate)], axis=2), timed


def _is_path(q: np.ndarray, times: np.ndarray) -> bool:
    """Whether joint positions (N, n) at their times (N,) lie on smooth curves: each near the cubic through the two before and after it."""
    middle = np.arange(2, len(q) - 2)
    about = middle[:, None] + np.array([-2, -1, 1, 2])
    weights = _weights(times[about] - times[middle][:, None], 0)
    missed = q[middle] - np.einsum("mk,mkn->mn", weights, q[about])
    steps = np.diff(q, axis=0)
    return bool((missed**2).mean() < _SMOOTH * (steps**2).mean())


def _rates(q: np.ndarray, times: np.ndarray, rows: int) -> np.ndarray:
    """Derivatives (N, n) of joint positions by time, of the polynomial through as many `rows`."""
    first = np.clip(np.arange(len(q)) - rows // 2, 0, len(q) - rows)
    about = first[:, None] + np.arange(rows)
    return np.einsum("mk,mkn->mn", _weights(times[about] - times[:, None], 1), q[about])


def _weights(offsets: np.ndarray, order: int) -> np.ndarray:
    """Weights (M, k) of values at `offsets` (M, k) in the derivative of this order, at 0, of the polynomial through them."""
    scale = np.abs(offsets).max(axis=1, keepdims=True)
    powers = (offsets / scale)[:, None, :] ** np.arange(offsets.shape[1])[:, None]
    wanted = np.zeros((*offsets.shape, 1))
    wanted[:, order, 0] = 1.0
    return np.linalg.solve(powers, wanted)[:, :, 0] / scale**order


def _velocity(model: RobotModel, poses: PoseSet, rate: np.ndarray) -> np.ndarray:
    """Change (N, 3) of the predicted points, m, with a lag: against their velocity at joint rates (N, n)."""
    ahead, behind = (
        predict_measurements(model, replace(poses, q=poses.q + sign * _STEP * rate)).position
        for sign in (1.0, -1.0)
    )
    return (behind - ahead) / (2 * _STEP)


def _reversals(model: RobotModel, poses: PoseSet, rate: np.ndarray) -> list[np.ndarray]:
    """Changes (N, 3) of the predicted points, m/rad, with a joint that stays behind by the same angle whichever way it moves."""
    signs = np.sign(rate)
    return [
        _velocity(model, poses, signs * (np.arange(poses.q.shape[1]) == joint))
        for joint in range(poses.q.shape[1])
    ]
