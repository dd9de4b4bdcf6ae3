"""Poses of a controller and joint positions of the nominal robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.compensation import ToolPoseTarget, nominal_joint_positions
from flexcal.model.kinematics import joint_limits
from flexcal.model.parts import rotation_vector, vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.statics import points_kinematics
from flexcal.model.urdf import Frame, read_urdf
from flexcal.programs import ProgramTarget

_BASE = "base"
"""Frame of a Universal Robots' URDF in which the controller gives poses: the base turned by half a turn."""
_STEP_LENGTH, _STEP_ANGLE = 0.05, 0.15
"""Largest distance (m) and angle (rad) between poses of a straight motion at which its configuration is followed."""


@dataclass(frozen=True, eq=False)
class ControllerPoses:
    """Poses of the controller and joint positions of the `nominal` robot: `tool` and `start` where the program has none."""

    nominal: RobotModel
    flange: str
    tool: tuple[float, ...]
    start: tuple[float, ...]

    @cached_property
    def base(self) -> Frame:
        """Frame in which the controller gives poses."""
        frames = read_urdf(self.nominal.urdf, self.nominal.config.locked).frames
        known = frames.get(_BASE)
        return Frame(-1, np.eye(3), np.zeros(3)) if known is None or known.joint >= 0 else known

    def poses(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions (N, 3) and rotations (N, 3, 3) of the flange."""
        at = points_kinematics(self.nominal, q, None, np.full(len(q), self.flange), jacobians=False)
        return at.position, at.orientation

    def joints(self, targets: Sequence[ProgramTarget]) -> tuple[np.ndarray, list[str]]:
        """Joint positions (N, 6) of the targets as the nominal robot takes them, and why one has none."""
        q, reasons = np.full((len(targets), 6), np.nan), [""] * len(targets)
        last = self.start or None
        lower, upper = joint_limits(self.nominal)
        for k, target in enumerate(targets):
            if target.joints:
                q[k] = target.values
                outside = np.flatnonzero((q[k] < lower) | (q[k] > upper))
                if len(outside):
                    reasons[k] = f"{self.nominal.motor_names[outside[0]]} is outside its limits"
                    continue
                last = target.values
                continue
            tool, near = target.tool or self.tool, target.near or last
            if not tool:
                reasons[k] = "the program sets no tool before it (set_tcp): give --tool"
            elif near is None:
                reasons[k] = (
                    "no joint positions stand before it or beside it (qnear), so the arm's configuration is unknown: give --start"
                )
            else:
                aim = self._aim(target.values, tool)
                path = self._line(near, aim) if target.straight and target.near is None else aim
                found = np.array([near])
                for step in range(len(path.target)):
                    found, (reasons[k],) = nominal_joint_positions(
                        self.nominal, path.subset(slice(step, step + 1)), found
                    )
                    if reasons[k]:
                        break
                else:
                    q[k], last = found[0], tuple(found[0])
        return q, reasons

    def values(self, targets: Sequence[ProgramTarget], q: np.ndarray) -> np.ndarray:
        """Numbers (N, 6) of the targets at other joint positions (N, 6)."""
        position, rotation = self.poses(q)
        found = q.copy()
        base = self.base
        for k, target in enumerate(targets):
            if target.joints:
                continue
            away, turned = _split(target.tool or self.tool)
            at = base.rotation.T @ (position[k] + rotation[k] @ away - base.translation)
            vector = rotation_vector(base.rotation.T @ rotation[k] @ turned)
            found[k] = [*at, *_nearest_turn(vector, np.array(target.values[3:]))]
        return found

    def _line(self, q: Sequence[float], aim: ToolPoseTarget) -> ToolPoseTarget:
        """Poses from that at `q` to the aim, along a line, so close that inverse kinematics cannot leave the arm's configuration."""
        assert aim.rotation is not None
        (position,), (rotation,) = self.poses(np.array([q]))
        away, turn = aim.position[0] - position, rotation_vector(aim.rotation[0] @ rotation.T)
        far = np.linalg.norm(away) / _STEP_LENGTH, np.linalg.norm(turn) / _STEP_ANGLE
        share = np.linspace(0, 1, max(2, int(np.ceil(max(far))) + 1))[1:]
        turns = np.array([vector_rotation(part * turn) @ rotation for part in share])
        turns[-1] = aim.rotation[0]
        positions = position + share[:, None] * away
        positions[-1] = aim.position[0]
        return ToolPoseTarget(np.repeat(aim.target, len(share)), positions, turns)

    def _aim(self, pose: Sequence[float], tool: Sequence[float]) -> ToolPoseTarget:
        """Pose of the flange in the robot's root frame."""
        base = self.base
        (at, turned), (away, beside) = _split(pose), _split(tool)
        rotation = base.rotation @ turned @ beside.T
        position = base.translation + base.rotation @ at - rotation @ away
        return ToolPoseTarget(np.array([self.flange]), position[None], rotation[None])


def _split(pose: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    return np.array(pose[:3]), vector_rotation(np.array(pose[3:]))


def _nearest_turn(vector: np.ndarray, old: np.ndarray) -> np.ndarray:
    """Rotation vector of the same rotation that is nearest to an old one: its angle may differ by whole turns."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return vector
    axis = vector / angle
    return min(
        (axis * (angle + 2 * np.pi * k) for k in range(-2, 3)), key=lambda v: float(np.linalg.norm(v - old))
    )
