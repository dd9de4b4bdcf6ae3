"""Inverse kinematics of points: damped Newton steps (Wampler 1986), for batches."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics.forward import joint_batch, motor_motion, point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

STEPS = 40
LONGEST = 0.5
"""Largest change of a joint in one step, rad or m."""
DAMPING = 0.02
"""Damping, m/rad: directions in which the target moves less than this per rad are hardly used."""
REACHED = 0.1 * MILLIMETRE


def reach_points(
    model: RobotModel,
    position: np.ndarray,
    q: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    *,
    point: str | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Joint positions (samples, n) that bring the target to `position` (samples, 3) m, base frame, and a mask (samples,) of those that
    converged.

    Found from the starts `q` (samples, n), within `lower` and `upper` (n,), in whatever orientation comes; to 0.1 mm, with the geometric
    errors that are known and without deflection. Raises `FlexcalError` for an unknown point or a wrong number of joints.
    """
    q = np.clip(joint_batch(model, q), lower, upper)
    for _ in range(STEPS):
        motion = point_kinematics(model, q, point=point, parameters=False)
        columns = motion.motion_jacobian[:, :3, :, 2] @ motor_motion(model)
        missing = position - motion.position
        step = damped_step(columns, missing, DAMPING)
        largest = np.abs(step).max(axis=1, initial=1e-12)
        q = np.clip(q + step * np.minimum(1.0, LONGEST / largest)[:, None], lower, upper)
    reached = point_kinematics(model, q, point=point, jacobians=False).position
    return q, np.linalg.norm(reached - position, axis=1) < REACHED


def damped_step(jacobian: np.ndarray, residual: np.ndarray, damping: np.ndarray | float) -> np.ndarray:
    """Jᵀ (J Jᵀ + λ²)⁻¹ r (N, n) for Jacobians (N, m, n), residuals (N, m) and dampings (N,)."""
    square = np.matmul(jacobian, np.swapaxes(jacobian, 1, 2))
    square += np.eye(jacobian.shape[1]) * np.square(np.broadcast_to(damping, len(residual)))[:, None, None]
    solved = np.linalg.solve(square, residual[:, :, None])
    return np.matmul(np.swapaxes(jacobian, 1, 2), solved)[:, :, 0]
