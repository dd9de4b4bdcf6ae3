"""Poses that a camera measures: of the camera on the board's place, or of the board before the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.camera.bundle import FreeViews
from flexcal.model.parts import rotation_wxyz


@dataclass(frozen=True, eq=False)
class ViewPoses:
    """Poses of a target in V views: `position` (V, 3), m, `quaternion_wxyz` (V, 4), their joint `covariance` (V, 6, 6) at known intrinsic
    parameters, m and rad in the instrument's axes, and `by_lens` (V, 6, 9), how these move them.
    """

    position: np.ndarray
    quaternion_wxyz: np.ndarray
    covariance: np.ndarray
    by_lens: np.ndarray


def view_poses(views: FreeViews, *, on_hand: bool) -> ViewPoses:
    """Poses of the camera in the board's frame where the camera is on the hand, else of the board in the camera's frame."""
    rotation, translation = views.rotation, views.translation
    if not on_hand:
        return ViewPoses(translation, rotation_wxyz(rotation), views.pose_covariance, views.by_lens)
    back = np.swapaxes(rotation, 1, 2)
    # p = -Rᵀ t: dp = -Rᵀ dt + Rᵀ (dφ × t), and the camera turns by -Rᵀ dφ about the board's axes
    inverse = np.zeros((len(back), 6, 6))
    inverse[:, :3, :3] = inverse[:, 3:, 3:] = -back
    inverse[:, :3, 3:] = np.matmul(back, np.cross(np.eye(3), translation[:, None, :]).swapaxes(1, 2))
    return ViewPoses(
        -np.matmul(back, translation[:, :, None])[:, :, 0],
        rotation_wxyz(back),
        inverse @ views.pose_covariance @ np.swapaxes(inverse, 1, 2),
        inverse @ views.by_lens,
    )
