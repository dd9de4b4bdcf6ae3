"""Tilt of a joint's axis under the gravity moment across it: the lateral compliance of bearing and links without springs of their own."""

from __future__ import annotations

import numpy as np

from flexcal.model.robot_model import RobotModel


def lateral_axes(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Axes of `misalignment_1` and `misalignment_2` (N, n, 2, 2) at `q` (N, n), by their components on the tilt axes x and y.

    The former are fixed to the parent link; the latter turn with the joint, but for `bearings: before`. Zero for prismatic joints.
    """
    from flexcal.model.tree import bearing_frame

    result = np.zeros((*q.shape, 2, 2))
    motion = q + model.geometry[:, 0] if model.bearings == "after" else np.zeros(q.shape)
    cosine, sine = np.cos(motion), np.sin(motion)
    for i, joint in enumerate(model.joints):
        if joint.kind != "revolute":
            continue
        frame = model.bearing_frames.get(i)
        x, y = (joint.normals @ (bearing_frame(joint) if frame is None else frame))[:, :2].T
        result[:, i, :, 0] = np.outer(cosine[:, i], x) + np.outer(sine[:, i], y)
        result[:, i, :, 1] = np.outer(cosine[:, i], y) - np.outer(sine[:, i], x)
    return result
