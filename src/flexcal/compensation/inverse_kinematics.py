"""Inverse kinematics within joint limits: damped least squares from a start, row by row."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexcal.compensation.tool_target import ToolPoseTarget
from flexcal.model.kinematics import damped_step, joint_limits
from flexcal.model.robot import RobotModel

Forward = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Function from row numbers (k,) and joint positions (k, n) to residuals (k, m) and their negative Jacobians (k, m, n)."""

_ITERATIONS = 300
_LONGEST_STEP = 0.3
_SMALL_GAIN = 1e-2
_PATIENCE = 8
"""Number of successive steps of small gain after which a row has converged: leaving a singular posture takes several."""
_LEAST_DAMPING = 1e-7
_FAR, NEAR = 1e-1, 1e-3
"""Initial dampings relative to the reach, for a target anywhere and for a near one."""


def inverse_kinematics(
    model: RobotModel, aim: ToolPoseTarget, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Joint positions (N, n) at which the undeflected robot reaches, or comes nearest to, every target; and a mask (N,) of those reached.

    As `nearest_positions` finds them from `start` (N, n).
    """
    q, residual = nearest_positions(
        model, aim, start, _FAR, lambda rows, q: aim.subset(rows).nominal(model, q)
    )
    return q, aim.reached(residual)


def nearest_positions(
    model: RobotModel, aim: ToolPoseTarget, start: np.ndarray, first_damping: float, forward: Forward
) -> tuple[np.ndarray, np.ndarray]:
    """Joint positions (N, n) within the limits that minimise the residuals (N, m) of `forward`, and these residuals.

    Levenberg-Marquardt from `start` (N, n): Δq = Jᵀ (J Jᵀ + λ²)⁻¹ r, of least joint change, at most 0.3 rad or m a step, and first with
    λ = `first_damping` · reach; a joint at a limit that the step would leave stands still. A row is at its end where steps keep gaining
    less than a hundredth.
    """
    lower, upper = joint_limits(model)
    weight = aim.weight(model)
    q = np.clip(start, lower, upper)
    residual, jacobian = forward(np.arange(len(q)), q)
    damping = np.full(len(q), first_damping * model.reach)
    idle = np.zeros(len(q), dtype=int)
    for _ in range(_ITERATIONS):
        rows = np.flatnonzero(~aim.reached(residual) & (idle < _PATIENCE))
        if not len(rows):
            break
        r, j = residual[rows] * weight, jacobian[rows] * weight[:, None]
        pull = np.matmul(r[:, None, :], j)[:, 0]
        at_limit = ((q[rows] <= lower) & (pull < 0)) | ((q[rows] >= upper) & (pull > 0))
        step = damped_step(np.where(at_limit[:, None, :], 0.0, j), r, damping[rows])
        step *= (_LONGEST_STEP / np.maximum(np.abs(step).max(axis=1), _LONGEST_STEP))[:, None]
        tried = np.clip(q[rows] + step, lower, upper)
        new_residual, new_jacobian = forward(rows, tried)
        before, after = (np.linalg.norm(x, axis=1) for x in (r, new_residual * weight))
        better = after < before
        idle[rows] = np.where(after > (1 - _SMALL_GAIN) * before, idle[rows] + 1, 0)
        won = rows[better]
        q[won], residual[won], jacobian[won] = tried[better], new_residual[better], new_jacobian[better]
        damping[rows] = np.where(
            better, np.maximum(damping[rows] / 4, _LEAST_DAMPING * model.reach), damping[rows] * 4
        )
    return q, residual
