"""Which joint positions bring a target to a point: damped Newton steps (Wampler 1986), a batch at once."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics import joint_batch, point_kinematics
from flexcal.model.robot_model import RobotModel
from flexcal.units import MILLIMETRE

STEPS = 40
LONGEST = 0.5
"""rad or m, of a joint in one step."""
DAMPING = 0.02
"""m/rad: directions in which the target moves less than this per rad are hardly used."""
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
    """Joint positions (samples, n) that bring the target to `position` (samples, 3) m, base frame, and whether they do, (samples,) of bool.

    Found from the starts `q` (samples, n), within `lower` and `upper` (n,), in whatever orientation comes; to 0.1 mm, with the geometric
    errors that are known and without deflection. Raises `FlexcalError` for an unknown point or a wrong number of joints.
    """
    q = np.clip(joint_batch(model, q), lower, upper)
    for _ in range(STEPS):
        motion = point_kinematics(model, q, point=point)
        columns = motion.geometry_jacobian[
            :, :3, : 6 * model.n : 6
        ]  # by the joint's offset, which moves it like q
        missing = position - motion.position
        square = columns @ np.swapaxes(columns, 1, 2) + DAMPING**2 * np.eye(3)
        step = np.einsum("sij,si->sj", columns, np.linalg.solve(square, missing[:, :, None])[:, :, 0])
        largest = np.abs(step).max(axis=1, initial=1e-12)
        q = np.clip(q + step * np.minimum(1.0, LONGEST / largest)[:, None], lower, upper)
    reached = point_kinematics(model, q, point=point, jacobians=False).position
    return q, np.linalg.norm(reached - position, axis=1) < REACHED
