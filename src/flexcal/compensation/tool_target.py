"""Target poses of the tool, and the residual of a pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.model.kinematics import PointKinematics, motor_motion
from flexcal.model.parts import rotation_vector
from flexcal.model.robot import RobotModel
from flexcal.model.statics import points_kinematics

_NEAR = 1e-9
"""Tolerance of every coordinate of the point (m) and of the rotation (rad) within which a pose is reached."""


@dataclass(frozen=True, eq=False)
class ToolPoseTarget:
    """Desired poses of N points, by name, in the base frame: `position` (N, 3) m and, if it counts, `rotation` (N, 3, 3).

    Residuals and Jacobians have m rows: three for the position, and three more for the rotation, or those about the directions `turns`
    (N, k, 3) in the base frame, about which an arm with fewer than six joints can turn its tool.
    """

    target: np.ndarray
    position: np.ndarray
    rotation: np.ndarray | None
    turns: np.ndarray | None = None

    @property
    def rows(self) -> int:
        """Number of rows of the residual m, 3 to 6."""
        if self.turns is not None:
            return 3 + self.turns.shape[1]
        return 3 if self.rotation is None else 6

    def weight(self, model: RobotModel) -> np.ndarray:
        """Factors (m,) that give all rows the unit of length: a rotation counts as the displacement at the distance of the robot's
        reach.
        """
        return np.array([1.0] * 3 + [model.reach] * (self.rows - 3))

    def subset(self, rows: np.ndarray | slice) -> ToolPoseTarget:
        """Rows with these indices or of this mask."""
        turn = None if self.rotation is None else self.rotation[rows]
        about = None if self.turns is None else self.turns[rows]
        return ToolPoseTarget(self.target[rows], self.position[rows], turn, about)

    def joined(self, others: Sequence[ToolPoseTarget]) -> ToolPoseTarget:
        """Rows of these targets and then those of others of the same kind."""
        every = [self, *others]

        def together(name: str) -> np.ndarray | None:
            values = [getattr(one, name) for one in every]
            return None if values[0] is None else np.concatenate(values)

        target, position = (
            np.concatenate([getattr(one, name) for one in every]) for name in ("target", "position")
        )
        return ToolPoseTarget(target, position, together("rotation"), together("turns"))

    def about(self, turns: np.ndarray) -> ToolPoseTarget:
        """Targets whose rotation counts about the directions `turns` (N, k, 3) only."""
        return replace(self, turns=turns)

    def own_rows(self, motion: np.ndarray) -> np.ndarray:
        """Rows (N, m, …) that count out of those of position and rotation (N, 6, …)."""
        if self.turns is None:
            return motion[:, : self.rows]
        turned = np.einsum("nki,ni...->nk...", self.turns, motion[:, 3:])
        return np.concatenate([motion[:, :3], turned], axis=1)

    def residual(self, at: PointKinematics) -> np.ndarray:
        """Target minus pose (N, m): position, m, then the rotation vector in base axes from pose to target, rad."""
        away = self.position - at.position
        if self.rotation is None:
            return away
        turn = np.matmul(self.rotation, np.swapaxes(at.orientation, 1, 2))
        return self.own_rows(np.hstack([away, rotation_vector(turn)]))

    def reached(self, residual: np.ndarray) -> np.ndarray:
        """Mask (N,) of residuals (N, m) within the tolerance."""
        return np.abs(residual).max(axis=1) < _NEAR

    def nominal(self, model: RobotModel, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual (N, m) and its negative Jacobian (N, m, n) of an undeflected robot at `q` (N, n)."""
        at = points_kinematics(model, q, None, self.target, jacobians=True, parameters=False)
        return self.residual(at), self.own_rows(at.motion_jacobian[:, :, :, 2]) @ motor_motion(model)
