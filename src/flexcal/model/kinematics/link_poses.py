"""Positions of joints and links, for figures, gravity preload and line of sight."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics.following_joints import joint_motion
from flexcal.model.kinematics.forward import joint_batch, point_kinematics
from flexcal.model.kinematics.placements import joint_placement
from flexcal.model.parts import axis_rotations
from flexcal.model.robot import RobotModel


def link_frames(model: RobotModel, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (samples, N, 3, 3) and origin (samples, N, 3), m, of every joint's link in the base frame at `q` (samples, n).

    Geometric errors count, deflection does not (Eqs. 15-17 with q_arm = q_motor). Raises `FlexcalError` for a wrong joint count.
    """
    q = joint_batch(model, q)
    if model.relations is not None:
        motion = joint_motion(model, q, np.zeros((len(q), len(model.joints), 3)), derivatives=False)
        q = motion.q + motion.deflection[:, :, 2]
    rotation = np.empty((*q.shape, 3, 3))
    origin = np.empty((*q.shape, 3))
    for i, joint in enumerate(model.joints):
        shift, turn = joint_placement(model, i)
        moved = q[:, i] + model.geometry.errors[i, 0]
        if joint.parent < 0:
            turned, origin[:, i] = np.broadcast_to(turn, (len(q), 3, 3)), shift
        else:
            parent = rotation[:, joint.parent]
            turned, origin[:, i] = parent @ turn, origin[:, joint.parent] + parent @ shift
        if joint.kind == "prismatic":
            rotation[:, i] = turned
            origin[:, i] += moved[:, None] * (turned @ joint.axis)
        else:
            rotation[:, i] = turned @ axis_rotations(joint.axis, moved)
    return rotation, origin


def joint_origins(model: RobotModel, q: np.ndarray, *, point: str | None = None) -> np.ndarray:
    """Corners (samples, joints + 2, 3), m, of the chain from the base through every joint to the target `point`.

    Joints of a tree that do not carry the target are left out. Raises `FlexcalError` for an unknown point or a wrong joint count.
    """
    chain = model.path_to(model.point(point).joint)
    _, origin = link_frames(model, q)
    target = point_kinematics(model, q, point=point, jacobians=False).position
    return np.concatenate([np.zeros((len(origin), 1, 3)), origin[:, chain], target[:, None]], axis=1)
