"""Poses of a controller and joint positions of the nominal robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.compensation import ToolPoseTarget, nominal_joint_positions
from flexcal.jobs.deployment.arm_postures import arm_postures
from flexcal.jobs.deployment.configured_joints import all_solutions, fitting_joints
from flexcal.jobs.deployment.controller_base import controller_base
from flexcal.jobs.deployment.controller_joints import ControllerJoints
from flexcal.model.kinematics import joint_limits
from flexcal.model.parts import rotation_vector, vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.statics import points_kinematics
from flexcal.programs import NewNumbers, Pose, ProgramTarget

_STEP_LENGTH, _STEP_ANGLE = 0.05, 0.15
"""Largest distance (m) and angle (rad) between poses of a straight motion at which its configuration is followed."""


@dataclass(frozen=True, eq=False)
class ControllerPoses:
    """Poses of the controller and joint positions of its nominal robot: `tool` where the program has none, `start` (6,) of the URDF."""

    controller: ControllerJoints
    flange: str
    tool: Pose | None
    start: np.ndarray | None

    @property
    def nominal(self) -> RobotModel:
        """The robot as the controller knows it."""
        return self.controller.nominal

    @cached_property
    def base(self) -> Pose:
        """Frame in which the controller gives poses."""
        return controller_base(self.nominal)

    def poses(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions (N, 3) and rotations (N, 3, 3) of the flange."""
        at = points_kinematics(self.nominal, q, None, np.full(len(q), self.flange), jacobians=False)
        return at.position, at.orientation

    def joints(self, targets: Sequence[ProgramTarget]) -> tuple[np.ndarray, list[str]]:
        """Joint positions (N, 6) of the targets as the nominal robot takes them, and why one has none."""
        q, reasons = np.full((len(targets), 6), np.nan), [""] * len(targets)
        last = self.start
        lower, upper = joint_limits(self.nominal)
        for k, target in enumerate(targets):
            if target.joints:
                q[k] = self.controller.to_urdf(np.array(target.values))
                outside = np.flatnonzero((q[k] < lower) | (q[k] > upper))
                if len(outside):
                    reasons[k] = f"{self.nominal.motor_names[outside[0]]} is outside its limits"
            else:
                q[k], reasons[k] = self._of_pose(target, last)
            if not reasons[k]:
                last = q[k]
        return q, reasons

    def new_numbers(
        self, targets: Sequence[ProgramTarget], old_q: np.ndarray, q: np.ndarray
    ) -> list[NewNumbers]:
        """Numbers of the targets at other joint positions (N, 6) than `old_q`, and configuration data, which stay where they were wrong."""
        position, rotation = self.poses(q)
        configured = any(target.configuration for target in targets)
        postures, old_postures = (
            (arm_postures(self.controller, each) for each in (q, old_q)) if configured else (q, old_q)
        )
        dialect = self.controller.dialect
        new = []
        for k, target in enumerate(targets):
            if target.joints:
                new.append(NewNumbers(tuple(self.controller.from_urdf(q[k]).tolist())))
                continue
            flange = self.base.inverse() @ Pose(position[k], rotation[k])
            pose = target.frame.inverse() @ flange @ self._tool(target)
            words, configuration = target.words, dialect.configuration
            if words and configuration is not None and configuration.fits(old_postures[k], words):
                words = configuration.updated(postures[k], words)
            new.append(NewNumbers(dialect.notation.pose_numbers(pose, target.values), words))
        return new

    def _tool(self, target: ProgramTarget) -> Pose:
        tool = target.tool or self.tool
        assert tool is not None
        return tool

    def _of_pose(self, target: ProgramTarget, last: np.ndarray | None) -> tuple[np.ndarray, str]:
        """Joint positions (6,) of a target that is a pose, and why it has none."""
        none = np.full(6, np.nan)
        if target.tool is None and self.tool is None:
            return none, target.missing
        near = None if target.near is None else self.controller.to_urdf(np.array(target.near))
        start = near if near is not None else last
        dialect = self.controller.dialect
        configuration = dialect.configuration if target.configuration else None
        if start is None and configuration is None:
            return none, f"{dialect.no_start}, so the arm's configuration is unknown: give --start"
        aim = self._aim(target)
        found, reason = none, ""
        if start is not None:
            # written configuration data that bind say more than the path
            followed = configuration is None or not configuration.on_lines
            found, reason = self._follow(start, aim, straight=target.straight and near is None and followed)
            if configuration is None:
                return found, reason
        return self._configured(target, aim, found[None][: int(not reason and start is not None)], start)

    def _follow(self, start: np.ndarray, aim: ToolPoseTarget, *, straight: bool) -> tuple[np.ndarray, str]:
        """Joint positions (6,) at the aim in the configuration that the arm has at `start`, and why there are none."""
        path = self._line(start, aim) if straight else aim
        found, reason = start[None], ""
        for step in range(len(path.target)):
            found, (reason,) = nominal_joint_positions(
                self.nominal, path.subset(slice(step, step + 1)), found
            )
            if reason:
                break
        return found[0], reason

    def _configured(
        self, target: ProgramTarget, aim: ToolPoseTarget, followed: np.ndarray, start: np.ndarray | None
    ) -> tuple[np.ndarray, str]:
        """Joint positions (6,) at the aim with the written configuration, first of those that are `followed` (N, 6)."""
        near = np.zeros(6) if start is None else start
        dialect = self.controller.dialect
        found = fitting_joints(self.controller, target.words, followed, near)
        if found is not None:
            return found, ""
        solutions = all_solutions(self.controller, aim)
        if not len(solutions):
            reason = nominal_joint_positions(self.nominal, aim, near[None])[1][0]
            return np.full(6, np.nan), reason or "out of reach"
        found = fitting_joints(self.controller, target.words, solutions, near)
        if found is not None:
            return found, ""
        assert dialect.configuration is not None
        if target.straight and len(followed) and not dialect.configuration.on_lines:
            return followed[0], ""
        words = ", ".join(target.words)
        return np.full(6, np.nan), (
            f"none of the {len(solutions)} solutions of inverse kinematics has the configuration ({words}): check the target, the "
            "tool and the frames, and whether the URDF counts joints as the controller does (--joint-signs, --joint-zeros)"
        )

    def _line(self, q: np.ndarray, aim: ToolPoseTarget) -> ToolPoseTarget:
        """Poses from that at `q` to the aim, along a line, so close that inverse kinematics cannot leave the arm's configuration."""
        assert aim.rotation is not None
        (position,), (rotation,) = self.poses(q[None])
        away, turn = aim.position[0] - position, rotation_vector(aim.rotation[0] @ rotation.T)
        far = np.linalg.norm(away) / _STEP_LENGTH, np.linalg.norm(turn) / _STEP_ANGLE
        share = np.linspace(0, 1, max(2, int(np.ceil(max(far))) + 1))[1:]
        turns = np.array([vector_rotation(part * turn) @ rotation for part in share])
        turns[-1] = aim.rotation[0]
        positions = position + share[:, None] * away
        positions[-1] = aim.position[0]
        return ToolPoseTarget(np.repeat(aim.target, len(share)), positions, turns)

    def _aim(self, target: ProgramTarget) -> ToolPoseTarget:
        """Pose of the flange in the robot's root frame."""
        pose = self.controller.dialect.notation.pose(target.values)
        at = self.base @ target.frame @ pose @ self._tool(target).inverse()
        return ToolPoseTarget(np.array([self.flange]), at.position[None], at.rotation[None])
