"""Orientations: the axes of a target in the station's frame, beside its point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.kinds.kind import Kind
from flexcal.data.poses import PoseSet
from flexcal.model.parts import (
    inverse_right_jacobians,
    left_jacobian,
    rotation_vector,
    vector_rotation,
    wxyz_rotation,
)
from flexcal.model.robot import STATION

if TYPE_CHECKING:
    from flexcal.calibration.measurement import PredictedMeasurements


class Orientations(Kind):
    """Rotation vector from the predicted to the measured axes of a target, whose own rotation on the robot is a parameter."""

    def rows(self, poses: PoseSet) -> np.ndarray:
        """As `Kind.rows`."""
        return poses.turned

    def angles(self, at: PredictedMeasurements) -> np.ndarray:
        """As `Kind.angles`: rotation vectors."""
        quaternion = at.poses.quaternion_wxyz
        assert quaternion is not None
        measured = wxyz_rotation(quaternion[at.poses.turned])
        return rotation_vector(np.matmul(measured, np.swapaxes(self._axes(at), 1, 2)))

    def angle_slopes(self, at: PredictedMeasurements) -> np.ndarray:
        """As `Kind.angle_slopes`."""
        return inverse_right_jacobians(self.angles(at))

    def owns(self, name: str) -> bool:
        """As `Kind.owns`."""
        return name.startswith("point.") and name.rpartition(".")[2] in STATION[3:]

    def column(self, at: PredictedMeasurements, name: str) -> np.ndarray:
        """As `Kind.column`."""
        owner, _, key = name.rpartition(".")
        target = owner.removeprefix("point.")
        turn, own = at.turn_of(target), at.poses.target[at.poses.angled] == target
        # R exp(v + dv) = exp(R Jr(v) dv) R for the predicted axes R exp(v), with Jr(v) = exp(-v) Jl(v)
        axis = vector_rotation(-turn) @ left_jacobian(turn)[:, "xyz".index(key[1])]
        column = np.zeros((len(at.readings.row), 3))
        column[len(at.poses) :] = own[:, None] * np.matmul(at.angle_slopes @ at.orientation, axis)
        return column

    def target_start(self, at: PredictedMeasurements, target: str) -> dict[str, float]:
        """As `Kind.target_start`: the mean of the rotations from predicted to measured axes."""
        quaternion, own = at.poses.quaternion_wxyz, at.poses.target[at.poses.turned] == target
        assert quaternion is not None
        between = np.matmul(np.swapaxes(self._axes(at), 1, 2), wxyz_rotation(quaternion[at.poses.turned]))
        left, _, right = np.linalg.svd(between[own].sum(axis=0))
        mean = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        return dict(zip(STATION[3:], rotation_vector(mean).tolist(), strict=True))

    def target_parameters(self, poses: PoseSet, target: str) -> Sequence[str]:
        """As `Kind.target_parameters`: its rotation."""
        return STATION[3:]

    def _axes(self, at: PredictedMeasurements) -> np.ndarray:
        """Predicted axes (K, 3, 3) of the targets whose axes were measured."""
        return at.orientation[at.poses.turned[at.poses.angled]]

    def tells_lengths(self, poses: PoseSet) -> bool:
        """As `Kind.tells_lengths`."""
        return False
