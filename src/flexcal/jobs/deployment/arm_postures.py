"""Postures of six-joint arms: what configuration data of controllers tell apart."""

from __future__ import annotations

import numpy as np

from flexcal.jobs.deployment.controller_joints import ControllerJoints
from flexcal.model.kinematics import link_frames


def arm_postures(joints: ControllerJoints, q: np.ndarray) -> np.ndarray:
    """Postures (N, 8), as `Configuration` defines them, of the nominal arm at joint positions `q` (N, 6) of the URDF.

    The wrist centre is the point of axis 5 that is nearest to axis 4, where these intersect for a spherical wrist. In front of axis 1 is
    the side on which the flange is at the controller's zero.
    """
    model = joints.nominal
    motors = [model.joints.index(joint) for joint in model.motor_joints]
    zero = joints.to_urdf(np.zeros(6))[None]
    rotation, origin = link_frames(model, np.concatenate([q, zero]))
    axes = np.stack([rotation[:, i] @ model.joints[i].axis for i in motors], axis=1)
    axes = axes * joints.signs[:, None]
    points = origin[:, motors]
    wrist = _nearest(points[:, 4], axes[:, 4], points[:, 3], axes[:, 3])
    ahead = np.cross(axes[:, 1], axes[:, 0])
    reach = np.einsum("ni,ni->n", wrist - points[:, 0], ahead)
    front = reach[:-1] * (1.0 if reach[-1] >= 0 else -1.0)
    arm = points[:, 2] - points[:, 1]
    arm = arm - np.einsum("ni,ni->n", arm, axes[:, 1])[:, None] * axes[:, 1]
    side = np.einsum("ni,ni->n", np.cross(arm, wrist - points[:, 1]), axes[:, 1]) / np.linalg.norm(
        arm, axis=1
    )
    return np.column_stack([joints.controller_radians(q), front, side[:-1]])


def _nearest(
    point: np.ndarray, axis: np.ndarray, other_point: np.ndarray, other_axis: np.ndarray
) -> np.ndarray:
    """Points (N, 3) of the lines through `point` along `axis` that are nearest to other lines; `point` where both are parallel."""
    slope = np.einsum("ni,ni->n", axis, other_axis)
    away = other_point - point
    along = np.einsum("ni,ni->n", away, axis) - slope * np.einsum("ni,ni->n", away, other_axis)
    share = np.where(1 - slope**2 > 1e-6, along / np.maximum(1 - slope**2, 1e-6), 0.0)
    return point + share[:, None] * axis
