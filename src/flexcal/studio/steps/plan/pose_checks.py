"""Collisions and lines of sight of planned poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.design.scene import (
    CollisionChecker,
    MeasuringSetup,
    RoughShape,
    below_base,
    station_position,
    visible,
)
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
        Whether bodies touch in each pose (N,); False where there are no shapes to check.
    close : tuple of tuple of pair of str
        Without collision shapes: joints whose links the drawn capsules have close together, for each pose; else empty.
    below : ndarray
        Without collision shapes: whether a joint or the point is below the base plane (N,); else False.
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
    close: tuple[tuple[tuple[str, str], ...], ...]
    below: np.ndarray
    seen: np.ndarray
    instrument: np.ndarray | None
    targets: np.ndarray | None

    @classmethod
    def of(cls, model: RobotModel, q: np.ndarray) -> PoseChecks:
        """Check poses (N, n); raises `InputError` where shapes or obstacles cannot be read."""
        checker = CollisionChecker(model)
        targets = point_kinematics(model, q, jacobians=False).position if model.points else None
        seen = visible(checker, q, MeasuringSetup.declared(model)) if model.points else np.ones(len(q), bool)
        close, below = ((),) * len(q), np.zeros(len(q), bool)
        if not checker.pairs:
            close = tuple(RoughShape.of(model).close(q))
            # of a robot that hangs, all is below
            below = below_base(model, q) if checker.floor is not None else below
        return cls(
            model, q, checker, checker.collides(q), close, below, seen, station_position(model), targets
        )

    @property
    def checked(self) -> bool:
        """Whether collisions were checked: the URDF has shapes."""
        return bool(self.checker.pairs)

    def looks(self, row: int) -> tuple[str, ...]:
        """Why to look at a pose whose collisions are not checked."""
        pairs = self.close[row]
        more = f" (and {len(pairs) - 1} more)" if len(pairs) > 1 else ""
        close = [f"links of {one} and {other}{more} close" for one, other in pairs[:1]]
        return (*close, "below the base plane") if self.below[row] else tuple(close)

    def touching(self, row: int) -> tuple[tuple[str, str], ...]:
        """Names of the bodies that touch in one pose, in pairs."""
        return self.checker.colliding(self.q[row]) if self.collides[row] else ()

    def words(self, row: int) -> str:
        """What is wrong with a pose, in a word or two; 'good' where nothing is, 'not checked' where collisions are not."""
        hidden = () if self.seen[row] else ("hidden",)
        if not self.checked:
            looks = self.looks(row)
            return ", ".join(("not checked", *hidden)) + (f"; look: {', '.join(looks)}" if looks else "")
        return ", ".join((*(("collides",) if self.collides[row] else ()), *hidden)) or "good"

    def sentences(self) -> list[tuple[str, Tone]]:
        """What the checks say of all poses."""
        return [self._collisions(), *self._rough(), self._sights()]

    def _collisions(self) -> tuple[str, Tone]:
        if not self.checked:
            return (
                "Collisions are not checked: the URDF has no collision shapes. Go to the poses slowly, or in a simulator, first.",
                "warning",
            )
        if not self.collides.any():
            return "No pose collides with the robot itself, the floor or an obstacle.", "good"
        return f"{_numbered(self.collides)}: bodies are in contact, or nearer than 10 mm.", "bad"

    def _rough(self) -> list[tuple[str, Tone]]:
        """What the drawn robot shows of poses that are not checked."""
        told: list[tuple[str, Tone]] = []
        near = np.array([bool(pairs) for pairs in self.close], bool)
        if near.any():
            told.append(
                (
                    f"{_numbered(near)}: look before you go there; links come close, as far as capsules from joint to joint show it, which "
                    "only guess the robot's shape.",
                    "warning",
                )
            )
        if self.below.any():
            told.append(
                (f"{_numbered(self.below)}: a joint or the point is below the base plane.", "warning")
            )
        return told

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
