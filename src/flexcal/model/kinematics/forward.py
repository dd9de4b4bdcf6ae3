"""Position of a target with all geometric errors and deflections, and its exact derivatives (Eqs. 1, 15-17)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.kinematics.following_joints import joint_motion
from flexcal.model.robot import ORIGIN, RobotModel


@dataclass(frozen=True, eq=False)
class PointKinematics:
    """A target at a batch of poses, in the robot's base frame.

    `position` (samples, 3) m; `orientation` (samples, 3, 3) of the tool frame; `geometry_jacobian` (samples, 6, G + 6) by offset,
    misalignments and lengths of every joint and what else is in `RobotModel.geometry_columns`, then of the tool; `motion_jacobian`
    (samples, 6, N, 3) by tilt about x, tilt about y and twist of every joint, with or without a motor, as the others follow. Rows of
    both: linear (m), then angular (rad).
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
            f"q has {batch.shape[-1]} columns but {model.name} has {model.n} {'joints' if model.relations is None else 'motors'}; "
            f"give (samples, {model.n}).",
        )
    return batch


def motor_motion(model: RobotModel) -> np.ndarray:
    """Motion (N, n) of every joint's own coordinate by the motors: what others that follow it do beside is in `motion_jacobian`."""
    return np.eye(model.n) if model.relations is None else model.relations.by_motor


def point_kinematics(
    model: RobotModel,
    q: np.ndarray,
    deflection: np.ndarray | None = None,
    *,
    point: str | None = None,
    jacobians: bool = True,
    parameters: bool = True,
) -> PointKinematics:
    """Forward kinematics of a target in the robot's base frame.

    `q` (samples, n) rad or m, motor side referred to the joint; `deflection` (samples, N, 3) rad: tilt about the bearing's x, its y,
    and what the arm turns beyond `q`, or beyond the relation of a joint without motor (backlash, spring twist, transmission error); zero
    when left out. Without `jacobians` these come back empty, that by geometry without `parameters`. NaN where a loop does not close. Raises
    `FlexcalError` for an unknown point or a wrong number of joints.
    """
    q = joint_batch(model, q)
    target = model.point(point)
    joints = len(model.joints)
    own = np.zeros((len(q), joints, 3)) if deflection is None else np.asarray(deflection, dtype=float)
    motion = None if model.relations is None else joint_motion(model, q, own, derivatives=jacobians)
    first = target.name == model.tool_point
    error = model.geometry.tool[3:] if first else np.zeros(3)
    shift = model.geometry.point_error[list(model.points).index(target.name)]
    tool = np.concatenate([model.geometry.tool[:3], error])
    position, orientation, geometry, by_motion = model.tree.point(
        target.joint,
        np.ascontiguousarray(target.rotation),
        np.ascontiguousarray(target.translation),
        target.xyz + shift,
        np.ascontiguousarray(model.geometry.errors),
        tool,
        q if motion is None else motion.q,
        np.ascontiguousarray(own) if motion is None else motion.deflection,
        jacobians,
        parameters,
    )
    if motion is not None and jacobians:
        twists = by_motion[:, :, 2::3]
        if parameters:
            by_errors = twists @ motion.by_geometry
            by_errors[:, :, : 6 * joints] += geometry[:, :, : 6 * joints]
            for joint in set(model.branching) & set(model.path_to(target.joint)):
                first = model.geometry_columns.get(f"{model.joints[joint].name}.{ORIGIN[0]}")
                if first is not None:
                    place, parent = slice(first, first + 3), 6 * model.joints[joint].parent + 3
                    by_errors[:, :, place] += (
                        np.eye(6, 3) if parent < 0 else geometry[:, :, parent : parent + 3]
                    )
            geometry = np.concatenate([by_errors, geometry[:, :, 6 * joints :]], axis=2)
        by_motion = by_motion + twists @ motion.by_motion
    return PointKinematics(position, orientation, geometry, by_motion.reshape(len(by_motion), 6, joints, 3))
