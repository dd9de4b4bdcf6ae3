"""Exact derivatives of a scalar function of the torque regressor with respect to the motion, in one reverse sweep over the tree."""

from __future__ import annotations

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.robot import RobotModel
from flexcal.model.torques.inertial_regressor import motion_batch


def torque_regressor_adjoint(
    model: RobotModel, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, weights: np.ndarray
) -> np.ndarray:
    """∂f/∂q, ∂f/∂q̇ and ∂f/∂q̈ (3, samples, n) of a scalar f(W), W that of `torque_regressor`, from `weights` = ∂f/∂W (samples, n, 10 n).

    `q`, `dq`, `ddq` (samples, n) in rad, m and s. Results are in units of f per rad (m where prismatic), rad/s and rad/s²; a sample's
    weights act on its own motion only. What stands in `weights` where link i is not beyond joint j is not read. It costs about two
    evaluations of W. For f = Σ λᵀ W χ it is the derivative of the inverse dynamics, λᵀ ∂τ/∂q, λᵀ ∂τ/∂q̇ and λᵀ M (Carpentier & Mansard
    2018); here every joint has inertial parameters of its own. Raises `FlexcalError` where shapes differ or do not fit the robot.
    """
    q, dq, ddq = motion_batch(model, q, dq, ddq)
    shape = (model.n, len(LINK_PARAMETERS) * model.n)
    if weights.shape != (len(q), *shape):
        raise FlexcalError(
            "E-MODEL-011",
            f"weights have shape {weights.shape}; give one for every entry of W: {(len(q), *shape)}.",
        )
    rows = weights.transpose(1, 2, 0).reshape(shape[0] * shape[1], len(q))
    return placed_regressor_adjoint(model, q, dq, ddq, np.arange(len(rows)).reshape(shape), rows)


def placed_regressor_adjoint(
    model: RobotModel, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, places: np.ndarray, weights: np.ndarray
) -> np.ndarray:
    """Adjoint of `write_torque_regressor`: row `places`[j, c] of `weights` (rows, samples) belongs to column c of joint j.

    `places` (n, 10 n) is -1 for what f does not depend on. Raises `FlexcalError` as that does.
    """
    q, dq, ddq = motion_batch(model, q, dq, ddq)
    if weights.ndim != 2 or weights.shape[1] != len(q):
        raise FlexcalError(
            "E-MODEL-012", f"weights have shape {weights.shape}; give rows of {len(q)} numbers, one a sample."
        )
    geometry, rows = np.ascontiguousarray(model.geometry.errors), np.ascontiguousarray(weights, dtype=float)
    return model.tree.torque_regressor_adjoint(geometry, model.gravity, q, dq, ddq, places, rows)
