"""Lines and arcs of the tool between targets, as the controller interpolates them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.model.parts import rotation_vector, vector_rotation
from flexcal.programs import Pose


@dataclass(frozen=True, eq=False)
class ToolPath:
    """Line from a pose of the tool to another, or arc through a third one: `share` 0 is the start, 1 the end, and 0.5 of an arc `via`."""

    start: Pose
    via: Pose | None
    end: Pose

    def pose(self, share: float) -> Pose:
        """Pose on the path; the tool turns about one axis, evenly."""
        turn = rotation_vector(self.start.rotation.T @ self.end.rotation)
        rotation = self.start.rotation @ vector_rotation(share * turn)
        if self.circle is None or self.via is None:
            return Pose(self.start.position + share * (self.end.position - self.start.position), rotation)
        centre, first, normal, angles = self.circle
        angle = np.interp(share, (0.0, 0.5, 1.0), (0.0, *angles))
        return Pose(centre + vector_rotation(angle * normal) @ first, rotation)

    def distance(self, position: np.ndarray, share: float) -> float:
        """Distance, m, of a position from the place on the line, or from the circle of the arc."""
        if self.circle is None:
            return float(np.linalg.norm(position - self.pose(share).position))
        centre, first, normal, _ = self.circle
        height = (position - centre) @ normal
        flat = np.linalg.norm(position - centre - height * normal)
        return float(np.hypot(height, flat - np.linalg.norm(first)))

    @cached_property
    def circle(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[float, float]] | None:
        """Centre, vector from it to the start, normal, and angles of `via` and the end about it; None for a line."""
        if self.via is None:
            return None
        a, b = self.via.position - self.start.position, self.end.position - self.start.position
        normal = np.cross(a, b)
        size = float(np.linalg.norm(normal))
        if size <= _FLAT * np.linalg.norm(a) * np.linalg.norm(b):
            return None
        away = np.cross((a @ a) * b - (b @ b) * a, normal) / (2 * size**2)
        normal = normal / size
        first = -away
        side = np.cross(normal, first)
        angles = [
            float(np.arctan2(point @ side, point @ first) % (2 * np.pi)) for point in (a - away, b - away)
        ]
        return self.start.position + away, first, normal, (angles[0], angles[1])


_FLAT = 1e-9
"""Sine of the angle at the start of an arc below which its three points lie on a line."""
