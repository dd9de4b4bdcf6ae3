"""Shapes of the arm at measured poses, with the errors of its tool."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.model.kinematics import LinkSurface, joint_positions
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import STATION, RobotModel


@dataclass(frozen=True, eq=False)
class ArmPoses:
    """Arm configurations at measured points, in the robot's base frame, m.

    `corners` (K, joints + 2, 3) from the base through every joint to the point, of some of the poses; `surface` (E, V, 3) vertices and
    `triangles` (F, 3) of the links in a few of them; `pose` (N,) numbers, `tip` (N, 3) points and `errors` (N, 3) by model of all.
    """

    corners: np.ndarray
    surface: np.ndarray
    triangles: np.ndarray
    pose: np.ndarray
    tip: np.ndarray
    errors: Mapping[str, np.ndarray]


_EXAMPLES = 3
"""Number of poses in which the links are drawn, as in the paper's figure."""


_MOST_ARMS = 60


_MOST_ARROWS = 1500


def arms_at(model: RobotModel, poses: PoseSet, errors: Mapping[str, np.ndarray]) -> ArmPoses:
    """Arm of `model` at the points, with `errors` (N, 3) m of the instrument's frame; if there are many, an even selection."""
    rows = evenly(len(poses), _MOST_ARROWS)
    corners = joint_polylines(model, poses.subset(rows))
    turned = {name: in_base(model, poses, vectors)[rows] for name, vectors in errors.items()}
    surface = LinkSurface.of(model)
    drawn = surface.at(model, poses.q[rows[evenly(len(rows), _EXAMPLES)]]).astype(np.float32)
    arms = corners[evenly(len(rows), _MOST_ARMS)]
    return ArmPoses(arms, drawn, surface.triangles, poses.pose[rows], corners[:, -1], turned)


def joint_polylines(model: RobotModel, poses: PoseSet) -> np.ndarray:
    """Polyline (N, joints + 2, 3) m of the undeflected arm from the base through every joint to the measured point, base frame,
    undeflected.
    """
    q = np.ascontiguousarray(joint_positions(model, poses.q))
    still = np.zeros((*q.shape, 3))
    target = model.point(str(poses.target[0]))

    def place(index: int, rotation: np.ndarray, translation: np.ndarray, xyz: np.ndarray) -> np.ndarray:
        frame = np.ascontiguousarray(rotation), np.ascontiguousarray(translation)
        geometry = np.ascontiguousarray(model.geometry.errors)
        return model.tree.point(index, frame[0], frame[1], xyz, geometry, np.zeros(6), q, still, False)[0]

    origins = [place(k, np.eye(3), np.zeros(3), np.zeros(3)) for k in model.path_to(target.joint)]
    tip = place(target.joint, target.rotation, target.translation, target.xyz)
    return np.stack([np.zeros_like(tip), *origins, tip], axis=1)


def in_base(model: RobotModel, poses: PoseSet, vectors: np.ndarray) -> np.ndarray:
    """Vectors (N, 3) of the instrument's frame turned into the robot's base frame."""
    turned = np.empty_like(vectors)
    for station in poses.stations:
        angles = np.array([model.value(f"station.{station}.{key}") for key in STATION[3:]])
        own = poses.station == station
        turned[own] = vectors[own] @ vector_rotation(angles)
    return turned


def evenly(total: int, most: int) -> np.ndarray:
    """Numbers of `most` of `total` things, evenly spread; of all where there are fewer."""
    return np.unique(np.linspace(0, total - 1, min(total, most)).astype(int))
