"""Position of a target with all geometric errors and deflections, and its exact derivatives (Eqs. 1, 15-17)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel


@dataclass(frozen=True, eq=False)
class PointKinematics:
    """A target at a batch of poses, in the robot's base frame.

    `position` (samples, 3) m; `orientation` (samples, 3, 3) of the tool frame; `geometry_jacobian` (samples, 6, 6 n + 6) by offset,
    misalignments and lengths of every joint, then of the tool; `motion_jacobian` (samples, 6, n, 3) by tilt about x, tilt about y and
    twist of every joint. Rows of both: linear (m), then angular (rad).
    """

    position: np.ndarray
    orientation: np.ndarray
    geometry_jacobian: np.ndarray
    motion_jacobian: np.ndarray


def joint_batch(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """`q` as a contiguous (samples, n) array; raises `FlexcalError` where the joint count differs."""
    batch = np.ascontiguousarray(np.atleast_2d(np.asarray(q, dtype=float)))
    if batch.ndim != 2 or batch.shape[1] != model.n:
        raise FlexcalError(
            "E-MODEL-001",
            f"q has {batch.shape[-1]} columns but {model.name} has {model.n} joints; give (samples, {model.n}).",
        )
    return batch


def point_kinematics(
    model: RobotModel,
    q: np.ndarray,
    deflection: np.ndarray | None = None,
    *,
    point: str | None = None,
    jacobians: bool = True,
) -> PointKinematics:
    """Forward kinematics of a target in the robot's base frame.

    `q` (samples, n) rad or m, motor side referred to the joint; `deflection` (samples, n, 3) rad: tilt about the bearing's x, its y,
    and what the arm turns beyond `q` (backlash, spring twist, transmission error); zero when left out. Without `jacobians` these come
    back empty. Raises `FlexcalError` for an unknown point or a wrong number of joints.
    """
    q = joint_batch(model, q)
    target = model.point(point)
    moved = np.zeros((*q.shape, 3)) if deflection is None else np.ascontiguousarray(deflection, dtype=float)
    first = target.name == next(iter(model.points))
    error = model.geometry.tool[3:] if first else np.zeros(3)
    own = model.geometry.point_error[list(model.points).index(target.name)]
    tool = np.concatenate([model.geometry.tool[:3], error])
    position, orientation, geometry, motion = model.tree.point(
        target.joint,
        np.ascontiguousarray(target.rotation),
        np.ascontiguousarray(target.translation),
        target.xyz + own,
        np.ascontiguousarray(model.geometry.errors),
        tool,
        q,
        moved,
        jacobians,
    )
    return PointKinematics(position, orientation, geometry, motion.reshape(len(motion), 6, model.n, 3))
