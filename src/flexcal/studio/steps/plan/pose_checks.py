"""Collisions and lines of sight of planned poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.design.scene import CollisionChecker, MeasuringSetup, station_position, visible
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.studio.window import Tone


@dataclass(frozen=True, eq=False)
class PoseChecks:
    """Checks of poses `q` (N, n) of a robot.

    Attributes
    ----------
    checker : CollisionChecker
        Bodies of the robot, floor and obstacles.
    collides : ndarray
        Whether bodies touch in each pose (N,).
    seen : ndarray
        Whether the instrument sees the target (N,).
    instrument : ndarray or None
        Where it stands, m in the base frame (3,); None where robot.yaml does not say.
    targets : ndarray or None
        The target in each pose (N, 3), m in the base frame; None for a robot without points.
    """

    model: RobotModel
    q: np.ndarray
    checker: CollisionChecker
    collides: np.ndarray
    seen: np.ndarray
    instrument: np.ndarray | None
    targets: np.ndarray | None

    @classmethod
    def of(cls, model: RobotModel, q: np.ndarray) -> PoseChecks:
        """Check poses (N, n); raises `InputError` where shapes or obstacles cannot be read."""
        checker = CollisionChecker(model)
        targets = point_kinematics(model, q, jacobians=False).position if model.points else None
        seen = visible(checker, q, MeasuringSetup.declared(model)) if model.points else np.ones(len(q), bool)
        return cls(model, q, checker, checker.collides(q), seen, station_position(model), targets)

    def touching(self, row: int) -> tuple[tuple[str, str], ...]:
        """Names of the bodies that touch in one pose, in pairs."""
        return self.checker.colliding(self.q[row]) if self.collides[row] else ()

    def words(self, row: int) -> str:
        """What is wrong with a pose, in a word or two; 'good' where nothing is."""
        wrong = [
            word for word, bad in (("collides", self.collides[row]), ("hidden", not self.seen[row])) if bad
        ]
        return ", ".join(wrong) or "good"

    def sentences(self) -> list[tuple[str, Tone]]:
        """What the checks say of all poses."""
        return [self._collisions(), self._sights()]

    def _collisions(self) -> tuple[str, Tone]:
        if not self.checker.pairs:
            return (
                "The URDF has no collision shapes, so collisions are not excluded: go to the poses slowly, or in a simulator, first.",
                "warning",
            )
        if not self.collides.any():
            return "No pose collides with the robot itself, the floor or an obstacle.", "good"
        return f"{_numbered(self.collides)}: bodies are in contact, or nearer than 10 mm.", "bad"

    def _sights(self) -> tuple[str, Tone]:
        if self.instrument is None:
            return (
                "robot.yaml does not say where the instrument stands (stations: {tracker: {xyz: [2.5, 0, 1]}}, m), so lines of sight are "
                "not checked.",
                "faint",
            )
        if not self.seen.all():
            return f"{_numbered(~self.seen)}: the instrument does not see the target.", "bad"
        if not self.model.config.stations[self.model.stations.names[0]].line_of_sight:
            return (
                "The lines of sight are drawn, but nothing is said to be in their way: robot.yaml does not ask for line_of_sight: true.",
                "faint",
            )
        return "The instrument sees the target in every pose.", "good"


def _numbered(mask: np.ndarray) -> str:
    numbers = [str(k + 1) for k in np.flatnonzero(mask)]
    shown = ", ".join(numbers[:8]) + (f" and {len(numbers) - 8} more" if len(numbers) > 8 else "")
    return f"{'Pose' if len(numbers) == 1 else 'Poses'} {shown}"
